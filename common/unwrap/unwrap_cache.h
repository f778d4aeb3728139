// Unwrapped meshes on disk, keyed by the input: baking the same mesh again does not solve again.
#pragma once

#include <filesystem>
#include <optional>

#include "common/base/hash.h"
#include "common/unwrap/unwrap.h"

namespace kiln {

// SHA-256 of positions, normals, triangles, settings and the version of the algorithm.
Digest unwrap_key(const Mesh& mesh, const UnwrapSettings& settings);

class UnwrapCache {
 public:
  // An empty path disables the cache. The folder is created on the first store.
  explicit UnwrapCache(std::filesystem::path folder, uint64_t max_bytes = uint64_t{2} << 30)
      : folder_(std::move(folder)), max_bytes_(max_bytes) {}
  // nullopt if there is no entry, or it is damaged or does not match this number of triangles.
  std::optional<UnwrapResult> load(const Digest& key, size_t triangles) const;
  // Writes by rename, so that several processes may share a folder, then removes the oldest entries until the
  // folder holds at most max_bytes. An unwritable folder disables the cache: nothing fails.
  void store(const Digest& key, const UnwrapResult& result) const;

 private:
  std::filesystem::path file_of(const Digest& key) const { return folder_ / (key.hex() + ".unwrap"); }
  void evict() const;
  std::filesystem::path folder_;
  uint64_t max_bytes_;
};

// $KILN_CACHE, else $XDG_CACHE_HOME/kiln, else $HOME/.cache/kiln, else empty.
std::filesystem::path default_cache_folder();

// unwrap() through the cache; small meshes are not cached.
UnwrapResult unwrap_cached(const Mesh& mesh, const UnwrapSettings& settings,
                           const std::filesystem::path& folder, unsigned threads);

}  // namespace kiln
