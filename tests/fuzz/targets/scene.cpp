// The structure chunk of a scene and the chunks that it names: each is a u32 of size and its bytes, and a
// chunk is found by its place, so that no digest stands in the way.
#include "common/scene/prepared.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_scene(std::span<const std::byte> data) {
  std::vector<Bytes> chunks;
  while (data.size() >= 4 && chunks.size() < 64) {
    uint32_t size = 0;
    std::memcpy(&size, data.data(), 4);
    data = data.subspan(4);
    const auto bytes = data.first(std::min<size_t>(size, data.size()));
    chunks.emplace_back(bytes.begin(), bytes.end());
    data = data.subspan(bytes.size());
  }
  if (chunks.empty()) return;
  require_sentence(scene_chunks(chunks[0]));
  size_t next = 1;
  const auto scene =
      read_scene(chunks[0], [&](const Digest&) { return next < chunks.size() ? &chunks[next++] : nullptr; });
  require_sentence(scene);
  if (scene) require(check_scene(*scene).has_value(), "a scene that was read obeys the rules of a scene");
}

}  // namespace kiln::fuzz
