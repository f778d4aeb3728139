// A scene file: text beginning with a brace is .gltf, anything else .glb.
#include "common/scene/prepared.h"
#include "coordinator/scene/import/import.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_gltf(std::span<const std::byte> data) {
  const bool json = !data.empty() && data[0] == std::byte{'{'};
  const auto result = import_scene(as_file(data, json ? ".gltf" : ".glb"), {});
  require_sentence(result);
  if (result) require(check_scene(result->scene).has_value(), "an imported scene obeys the rules of a scene");
}

}  // namespace kiln::fuzz
