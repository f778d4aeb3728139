#include "worker/agent/replay.h"

#include <algorithm>
#include <charconv>
#include <map>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "common/scene/prepared.h"
#include "worker/agent/disk_cache.h"
#include "worker/agent/ready_job.h"
#include "worker/agent/shared_cache.h"

namespace kiln {
namespace {

constexpr uint64_t kMaxReplayBytes = 64u << 20;

std::string to_hex(const Bytes& bytes) {
  std::string hex;
  for (const std::byte b : bytes) hex += text("{:02x}", static_cast<unsigned>(b));
  return hex;
}

Expected<Bytes> from_hex(std::string_view hex) {
  Bytes bytes(hex.size() / 2);
  for (size_t i = 0; i < bytes.size(); ++i) {
    uint8_t value = 0;
    const char* at = hex.data() + 2 * i;
    if (std::from_chars(at, at + 2, value, 16).ptr != at + 2) bytes.clear();
    if (bytes.empty()) break;
    bytes[i] = std::byte{value};
  }
  if (bytes.empty() || hex.size() % 2) return fail(ErrorKind::kInvalidInput, "\"job\" is not hexadecimal");
  return bytes;
}

template <class T>
Expected<T> to_number(const std::string& key, std::string_view digits) {
  T value{};
  const auto [stop, code] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (code != std::errc() || stop != digits.data() + digits.size())
    return fail(ErrorKind::kInvalidInput, text("\"{}\" holds \"{}\", which is not a number", key, digits));
  return value;
}

}  // namespace

std::string write_replay(const Replay& replay, const std::unordered_set<Digest>& chunks) {
  JsonWriter json;
  json.begin_object();
  json.pair("job", to_hex(write_job(replay.job)));
  json.pair("unit", text("{}", replay.unit.id));  // as text, because JSON numbers may lose bits
  json.pair("first_sample", replay.unit.first_sample);
  json.pair("sample_count", replay.unit.sample_count);
  json.pair("replicate", replay.unit.replicate);
  json.pair("take", replay.unit.take);
  if (replay.unit.cache != Digest{}) json.pair("cache", replay.unit.cache.hex());
  std::string sites;
  for (const uint32_t site : replay.unit.sites) sites += text("{}{}", sites.empty() ? "" : ",", site);
  json.pair("sites", sites);
  std::vector<Digest> sorted(chunks.begin(), chunks.end());
  std::sort(sorted.begin(), sorted.end());
  json.key("chunks").begin_array();
  for (const Digest& id : sorted) json.value(id.hex());
  json.end_array().end_object();
  return json.take();
}

Expected<Replay> read_replay(std::string_view content) {
  KILN_TRY(const auto pairs, parse_flat_json(content));
  std::map<std::string, std::string> values(pairs.begin(), pairs.end());
  for (const char* key : {"job", "unit", "first_sample", "sample_count", "replicate", "sites"})
    if (!values.count(key)) return fail(ErrorKind::kInvalidInput, text("\"{}\" is missing", key));
  Replay replay;
  KILN_TRY(const Bytes job, from_hex(values["job"]));
  KILN_TRY(replay.job, read_job(job));
  KILN_TRY(replay.unit.id, to_number<uint64_t>("unit", values["unit"]));
  KILN_TRY(replay.unit.first_sample, to_number<uint32_t>("first_sample", values["first_sample"]));
  KILN_TRY(replay.unit.sample_count, to_number<uint32_t>("sample_count", values["sample_count"]));
  if (values.count("take")) {  // files of earlier releases have none
    KILN_TRY(replay.unit.take, to_number<uint32_t>("take", values["take"]));
  }
  KILN_TRY(replay.unit.replicate, to_number<uint32_t>("replicate", values["replicate"]));
  if (replay.unit.replicate >= kReplicates)
    return fail(ErrorKind::kInvalidInput,
                text("\"replicate\" is {}, of 0 to {}", replay.unit.replicate, kReplicates - 1));
  if (values.count("cache")) {
    KILN_TRY(replay.unit.cache, Digest::from_hex(values["cache"]));
  }
  std::string_view rest = values["sites"];
  while (!rest.empty()) {
    const size_t comma = rest.find(',');
    KILN_TRY(const uint32_t site, to_number<uint32_t>("sites", rest.substr(0, comma)));
    replay.unit.sites.push_back(site);
    rest = comma == std::string_view::npos ? std::string_view{} : rest.substr(comma + 1);
  }
  return replay;
}

Expected<std::string> run_replay(const std::string& file, const AgentSettings& settings) {
  if (settings.cache_folder.empty())
    return fail(ErrorKind::kUsage,
                "a unit is replayed from the chunks in the cache: name it with --cache DIR");
  KILN_TRY(const Bytes content, read_file(file, kMaxReplayBytes));
  auto replay = read_replay({reinterpret_cast<const char*>(content.data()), content.size()});
  if (!replay) return fail(replay.error().kind, text("{}: {}", file, replay.error().message));
  const auto disk = DiskCache::open(settings.cache_folder, settings.cache_bytes);
  if (!disk) return fail(ErrorKind::kIo, text("the cache in {} cannot be used", settings.cache_folder));
  const auto load = [&](const Digest& id) -> Expected<ChunkBytes> {
    ChunkBytes bytes = disk->read(id);
    if (!bytes)
      return fail(ErrorKind::kUnavailable,
                  text("chunk {} is not in {} any more: copy the cache of a worker that bakes this job",
                       id.hex(), settings.cache_folder));
    return bytes;
  };
  ChunkCache chunks;
  JobFetch fetch(replay->job, chunks);
  for (;;) {
    KILN_TRY(const auto missing, fetch.missing());
    if (missing.empty()) break;
    for (const Digest& id : missing) {
      KILN_TRY(ChunkBytes bytes, load(id));
      chunks.put(id, std::move(bytes));
    }
  }
  KILN_TRY(const auto baker, make_ready_baker(replay->job, chunks_of(chunks, fetch), settings));
  std::optional<SharedCache> shared;
  const IrradianceCache* cache = nullptr;
  if (const Digest& id = replay->unit.cache; id != Digest{}) {
    KILN_TRY(ChunkBytes bytes, load(id));
    shared.emplace(id, std::move(bytes), baker->sites());
    KILN_TRY(cache, shared->get());
  }
  KILN_TRY(const UnitResult result, baker->bake(replay->unit, cache));
  return text("digest {}\nrays {}\nsamples dropped, not finite {}\nseconds {:.3f}\n",
              result_digest(result).hex(), result.rays, result.nonfinite, result.seconds);
}

}  // namespace kiln
