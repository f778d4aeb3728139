// A map that compare reads.
#include "coordinator/scene/imageio/exr.h"

#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_exr(std::span<const std::byte> data) {
  const auto planes = read_exr(as_file(data, ".exr"), uint64_t{1} << 20);
  require_sentence(planes);
  if (!planes) return;
  require(planes->names.size() == planes->data.size(), "a name for every plane");
  for (const auto& plane : planes->data)
    require(plane.size() == size_t{planes->width} * planes->height, "every plane is whole");
}

}  // namespace kiln::fuzz
