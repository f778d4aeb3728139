#include "common/unwrap/unwrap_cache.h"

#include <algorithm>
#include <cstdlib>

#include "common/base/files.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

constexpr uint64_t kVersion = 2;  // of the algorithm and the format: raise it when either changes
constexpr size_t kWorthwhile = 2000;

Bytes encode(const Digest& key, const UnwrapResult& result) {
  ByteWriter w;
  w.put(kVersion);
  w.put(key.bytes);
  w.put_array(result.charts.corner_uv);
  w.put_array(result.charts.chart_of_face);
  w.put(result.charts.chart_count);
  w.put_string(result.limited);
  w.put(result.stretch);
  Bytes bytes = w.take();
  ByteWriter sum;
  sum.put(xxh3(bytes));
  const Bytes tail = sum.take();
  bytes.insert(bytes.end(), tail.begin(), tail.end());
  return bytes;
}

std::optional<UnwrapResult> decode(std::span<const std::byte> bytes, const Digest& key, size_t triangles) {
  if (bytes.size() < sizeof(uint64_t)) return std::nullopt;
  const auto body = bytes.first(bytes.size() - sizeof(uint64_t));
  if (ByteReader(bytes.last(sizeof(uint64_t))).get<uint64_t>() != xxh3(body)) return std::nullopt;
  ByteReader r(body);
  if (r.get<uint64_t>() != kVersion || r.get<decltype(key.bytes)>() != key.bytes) return std::nullopt;
  UnwrapResult result;
  result.charts.corner_uv = r.get_array<Vec2>();
  result.charts.chart_of_face = r.get_array<uint32_t>();
  result.charts.chart_count = r.get<uint32_t>();
  result.charts.generated = true;
  result.limited = r.get_string();
  result.stretch = r.get<Stretch>();
  const MeshCharts& c = result.charts;
  if (!r.at_end() || c.chart_of_face.size() != triangles || c.corner_uv.size() != 3 * triangles ||
      c.chart_count > triangles)
    return std::nullopt;
  for (uint32_t chart : c.chart_of_face)
    if (chart >= c.chart_count) return std::nullopt;
  for (const Vec2& uv : c.corner_uv)
    if (!std::isfinite(uv.x) || !std::isfinite(uv.y)) return std::nullopt;
  return result;
}

}  // namespace

Digest unwrap_key(const Mesh& mesh, const UnwrapSettings& s) {
  ByteWriter w;
  w.put(kVersion);
  w.put(s.crease_degrees);
  w.put(s.grow.cone_degrees);
  w.put(s.grow.max_faces);
  w.put(s.limits.l2);
  w.put(s.limits.linf);
  w.put(s.max_charts);
  w.put(s.merge_work_per_face);
  w.put(s.max_work);
  w.put<uint64_t>(mesh.positions.size());
  w.put<uint64_t>(mesh.triangles.size());
  Sha256 sha;
  sha.add(w.take());
  sha.add(bytes_of(mesh.positions));
  sha.add(bytes_of(mesh.normals));
  sha.add(bytes_of(mesh.triangles));
  return sha.finish();
}

std::optional<UnwrapResult> UnwrapCache::load(const Digest& key, size_t triangles) const {
  if (folder_.empty()) return std::nullopt;
  const Expected<Bytes> bytes = read_file(file_of(key), 1024 + 64 * uint64_t{triangles});
  return bytes ? decode(*bytes, key, triangles) : std::nullopt;
}

void UnwrapCache::store(const Digest& key, const UnwrapResult& result) const {
  if (folder_.empty()) return;
  std::error_code ignored;
  fs::create_directories(folder_, ignored);
  const Bytes bytes = encode(key, result);
  if (bytes.size() <= max_bytes_ && write_file_atomic(file_of(key), bytes)) evict();
}

void UnwrapCache::evict() const {
  struct Entry {
    fs::file_time_type time;
    fs::path path;
    uint64_t bytes;
  };
  std::vector<Entry> entries;
  uint64_t all = 0;
  std::error_code error;  // another process may remove a file between any two of these calls
  for (fs::directory_iterator it(folder_, error), end; !error && it != end; it.increment(error)) {
    if (it->path().extension() != ".unwrap") continue;
    std::error_code gone;
    const Entry entry{it->last_write_time(gone), it->path(), gone ? 0 : it->file_size(gone)};
    if (gone) continue;
    all += entry.bytes;
    entries.push_back(entry);
  }
  std::sort(entries.begin(), entries.end(), [](const Entry& a, const Entry& b) {
    return a.time != b.time ? a.time < b.time : a.path < b.path;
  });
  for (size_t i = 0; i < entries.size() && all > max_bytes_; ++i) {
    std::error_code gone;
    fs::remove(entries[i].path, gone);
    all -= entries[i].bytes;
  }
}

fs::path default_cache_folder() {
  const auto variable = [](const char* name) {
    const char* value = std::getenv(name);
    return fs::path(value ? value : "");
  };
  if (const fs::path own = variable("KILN_CACHE"); !own.empty()) return own;
  if (const fs::path xdg = variable("XDG_CACHE_HOME"); !xdg.empty()) return xdg / "kiln";
  if (const fs::path home = variable("HOME"); !home.empty()) return home / ".cache" / "kiln";
  return {};
}

UnwrapResult unwrap_cached(const Mesh& mesh, const UnwrapSettings& settings, const fs::path& folder,
                           unsigned threads) {
  if (folder.empty() || mesh.triangles.size() < kWorthwhile) return unwrap(mesh, settings, threads);
  const UnwrapCache cache(folder);
  const Digest key = unwrap_key(mesh, settings);
  if (std::optional<UnwrapResult> known = cache.load(key, mesh.triangles.size())) return std::move(*known);
  UnwrapResult made = unwrap(mesh, settings, threads);
  cache.store(key, made);
  return made;
}

}  // namespace kiln
