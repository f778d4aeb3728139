// The file of --probes.
#include "coordinator/scene/probes/probes.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_probe_file(std::span<const std::byte> data) {
  const auto boxes = read_probe_file(as_file(data, ".json"));
  require_sentence(boxes);
  if (!boxes) return;
  for (const ProbeBox& box : *boxes) require(fault_of(box).empty(), "a volume that was read is whole");
}

}  // namespace kiln::fuzz
