// Draco data of a primitive with three attributes. Memory that the decoder asks for is bounded.
#include "coordinator/scene/document/draco.h"

#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_draco(std::span<const std::byte> data) {
  constexpr uint64_t kMost = uint64_t{256} << 20;
  uint64_t taken = 0;
  const auto take = [&](uint64_t bytes) -> Status {
    taken += std::min(bytes, kMost + 1);
    if (taken <= kMost) return {};
    return fail(ErrorKind::kInvalidInput, "more than the budget");
  };
  const auto mesh = unpack_draco(data, {{0, 5126, 3}, {1, 5126, 3}, {2, 5126, 2}}, take);
  require_sentence(mesh);
  if (!mesh) return;
  for (const uint32_t index : mesh->indices) require(index < mesh->vertices, "corners are vertices");
  require(mesh->attributes.size() == 3 && mesh->attributes[2].size() == size_t{mesh->vertices} * 8,
          "attributes are as requested");
}

}  // namespace kiln::fuzz
