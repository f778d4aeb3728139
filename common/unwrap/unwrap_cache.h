// Unwrapped meshes on disk, by what went in: a bake of the same mesh does not solve again.
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
  // An empty folder: no cache. The folder is made when something is stored.
  explicit UnwrapCache(std::filesystem::path folder, uint64_t max_bytes = uint64_t{2} << 30)
      : folder_(std::move(folder)), max_bytes_(max_bytes) {}
  // Nothing where there is no entry, or one that is damaged or does not fit a mesh of so many triangles.
  std::optional<UnwrapResult> load(const Digest& key, size_t triangles) const;
  // Written by rename, so that several processes may share a folder. Then the oldest entries go until the
  // folder holds max_bytes. A folder that cannot be written is as good as none: nothing fails.
  void store(const Digest& key, const UnwrapResult& result) const;

 private:
  std::filesystem::path file_of(const Digest& key) const { return folder_ / (key.hex() + ".unwrap"); }
  void evict() const;
  std::filesystem::path folder_;
  uint64_t max_bytes_;
};

// $KILN_CACHE, else $XDG_CACHE_HOME/kiln, else $HOME/.cache/kiln, else empty.
std::filesystem::path default_cache_folder();

// unwrap() through the cache; small meshes are not worth a file.
UnwrapResult unwrap_cached(const Mesh& mesh, const UnwrapSettings& settings,
                           const std::filesystem::path& folder, unsigned threads);

}  // namespace kiln
