// A scene as content-addressed chunks: one per mesh and texture and one for the structure that names
// them. A chunk's id is the SHA-256 of its bytes, so a repeated mesh, an unchanged texture or a second
// job costs nothing to send again. The id of the structure chunk is the id of the scene.
#pragma once

#include <functional>
#include <unordered_map>

#include "common/base/bytes.h"
#include "common/base/hash.h"
#include "common/base/status.h"
#include "common/scene/scene.h"

namespace kiln {

class ChunkStore {
 public:
  Digest add(Bytes bytes);  // keeps one copy
  const Bytes* find(const Digest& id) const;
  size_t total_bytes() const { return total_; }
  size_t size() const { return chunks_.size(); }

 private:
  std::unordered_map<Digest, Bytes> chunks_;
  size_t total_ = 0;
};

// Adds all chunks of the scene and returns its id. Instances that do not reflect get black materials;
// `receive` is not sent, because the atlas implies it.
Digest write_scene(const Scene& scene, ChunkStore& store);

// Ids of the chunks that the structure chunk names, in the order read_scene wants them.
Expected<std::vector<Digest>> scene_chunks(std::span<const std::byte> structure);

// Rebuilds the scene. `find` yields the bytes of a chunk, or null. Every index and size is checked: a
// hostile structure fails, never crashes.
Expected<Scene> read_scene(std::span<const std::byte> structure,
                           const std::function<const Bytes*(const Digest&)>& find);

// Checks the invariants of scene.h, which the output of import and of read_scene both satisfy.
Status check_scene(const Scene& scene);

}  // namespace kiln
