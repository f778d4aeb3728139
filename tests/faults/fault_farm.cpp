// kiln-fault-farm FOLDER [--listen HOST] [--units N] [--kilobytes N] [--lease MS] [--audit-first N] [--quorum
// Q]
//                 [--on-poison fail|skip] [--ca F --certificate F --key F]
// A coordinator without a store or a scene of its own, for faults of workers and networks at leases of
// seconds: bakes N units of a test job with whoever comes to FOLDER/address and shows FOLDER/token.
// FOLDER/done counts the units; the last thing written is FOLDER/outcome.json: the digest of all results in
// the order of units, or the error; what happened; what `why` says of the job, skipped units and workers.
#include <cstdio>
#include <map>

#include "common/atlas/atlas.h"
#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "common/tls/identity.h"
#include "coordinator/farm/dispatch/farm.h"

namespace kiln::test {
namespace {

constexpr JobId kJob = 77;

struct Wish {
  std::filesystem::path folder;
  FarmSettings farm;
  JobTraits traits;
  TlsFiles tls;
  size_t units = 200, kilobytes = 64;
};

Expected<Wish> read_wish(int argc, char** argv) {
  if (argc < 2 || argc % 2 != 0) return fail(ErrorKind::kUsage, "kiln-fault-farm FOLDER [--option VALUE]...");
  Wish w;
  w.folder = argv[1];
  w.farm.local_workers = 0;
  w.farm.others_may_come = w.farm.plain_is_fine = true;
  w.farm.rules.lease_ms = 3000;
  for (int i = 2; i < argc; i += 2) {
    const std::string name = argv[i], value = argv[i + 1];
    if (name == "--listen")
      w.farm.listen_host = value;
    else if (name == "--units")
      w.units = std::stoul(value);
    else if (name == "--kilobytes")
      w.kilobytes = std::stoul(value);
    else if (name == "--lease")
      w.farm.rules.lease_ms = std::stol(value);
    else if (name == "--audit-first")
      w.farm.rules.audit_first = static_cast<uint32_t>(std::stoul(value));
    else if (name == "--quorum")
      w.traits.quorum = static_cast<uint32_t>(std::stoul(value));
    else if (name == "--on-poison")
      w.traits.poison = value == "skip" ? PoisonPolicy::kSkip : PoisonPolicy::kFail;
    else if (name == "--ca")
      w.tls.ca = value;
    else if (name == "--certificate")
      w.tls.certificate = value;
    else if (name == "--key")
      w.tls.key = value;
    else
      return fail(ErrorKind::kUsage, "unknown option " + name);
  }
  return w;
}

// A quad whose texture makes the scene so large on the wire: its bytes do not compress.
JobSpec make_job(size_t kilobytes, ChunkStore& chunks) {
  Scene s;
  Mesh m;
  m.name = "quad";
  m.positions = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  m.normals.assign(4, Vec3(0, 0, 1));
  m.triangles = {{0, 1, 2}, {0, 2, 3}};
  m.source_triangle = {0, 1};
  s.meshes.push_back(m);
  s.materials.push_back({"metallic_roughness", "white", Mat4x3(1.0f), {}});
  Texture t;
  t.name = "noise";
  t.width = 1024, t.height = static_cast<uint32_t>(kilobytes), t.channels = 1;
  for (uint32_t i = 0; i < t.width * t.height; ++i)
    t.texels.push_back(std::byte(xxh3(std::as_bytes(std::span(&i, 1))) & 255));
  s.textures.push_back(t);
  s.instances.push_back({0, 0, Mat4x3(1.0f), "node", 0, 0, 0});
  Atlas a;
  a.width = a.height = 4;
  a.charts.push_back({{{0, 0}, {1, 0}, {1, 1}, {0, 0}, {1, 1}, {0, 1}}, {0, 0}, {}, 1, false});
  a.charts_of_instance = {0};
  a.instance_first_chart = {0, 1};
  a.placements.push_back({Vec2(4.0f), Vec2(0.0f), 0});
  a.sites.first_word = {0};
  JobSpec spec;
  spec.id = kJob;
  spec.scene = write_scene(s, chunks);
  spec.atlas = chunks.add(write_atlas(a));
  return spec;
}

std::vector<WorkUnit> make_units(size_t count) {
  std::vector<WorkUnit> units;
  for (size_t i = 0; i < count; ++i) {
    WorkUnit u{1 + i, 0, 8, {}};
    for (uint32_t s = 0; s < 16; ++s) u.sites.push_back(static_cast<uint32_t>(i * 16 + s));
    units.push_back(u);
  }
  return units;
}

void write_lines(JsonWriter& w, std::string_view key, const std::vector<std::string>& lines) {
  w.key(key).begin_array();
  for (const std::string& line : lines) w.value(line);
  w.end_array();
}

Expected<bool> bake_and_tell(Wish& wish) {
  if (!wish.tls.ca.empty()) {
    KILN_TRY(wish.farm.tls, TlsContext::load(wish.tls));
  } else {
    KILN_TRY(const Bytes token, read_file(wish.folder / "token", 4096));
    wish.farm.token.assign(reinterpret_cast<const char*>(token.data()), token.size());
  }
  ChunkStore chunks;
  const JobSpec spec = make_job(wish.kilobytes, chunks);
  KILN_TRY(const auto farm, Farm::start(wish.farm));
  KILN_TRY(const auto job, farm->open_job({spec, &chunks, wish.traits, {}}));
  KILN_TRY_STATUS(
      write_file_atomic(wish.folder / "address", text("{}:{}\n", wish.farm.listen_host, farm->port())));

  std::map<uint64_t, Digest> results;
  std::map<uint64_t, std::string> skipped;
  bool twice = false;
  PassHandlers handlers;
  handlers.on_result = [&](const WorkUnit& unit, const UnitResult& result) -> Status {
    twice |= !results.emplace(unit.id, result_digest(result)).second;
    return write_file_atomic(wish.folder / "done", text("{}\n", results.size()));
  };
  handlers.on_skipped = [&](const WorkUnit& unit, const std::string& reason) { skipped[unit.id] = reason; };
  Expected<PassEnd> end = job->run_pass(make_units(wish.units), 0, handlers);
  uint64_t rewinds = 0;
  for (; end && *end == PassEnd::kRewound; ++rewinds) {
    results.clear();
    skipped.clear();
    end = job->run_pass(make_units(wish.units), 0, handlers);
  }
  const bool complete = end && !twice && results.size() + skipped.size() == wish.units;

  Sha256 all;
  for (const auto& [unit, digest] : results) all.add(std::as_bytes(std::span(digest.bytes)));
  const FarmStatistics s = job->statistics();
  const FarmStatus status = farm->status();
  JsonWriter w;
  w.begin_object().pair("digest", complete ? all.finish().hex() : "");
  w.pair("error", !end ? end.error().message : twice ? "a unit was committed twice" : "");
  w.pair("units", static_cast<uint64_t>(results.size())).pair("rewinds", rewinds);
  w.pair("duplicates", s.duplicates).pair("reassigned", s.reassigned).pair("workers_lost", s.workers_lost);
  const Verification& v = s.verification;
  w.pair("verified", v.verified).pair("unverified", v.unverified).pair("waived", v.waived);
  w.pair("refused", status.refused_connections).pair("expelled", status.expelled);
  w.pair("connections", status.connections);
  write_lines(w, "events", s.events);
  std::vector<std::string> why = farm->why_job(kJob);
  for (const auto& [unit, reason] : skipped) {
    why.push_back(text("unit {} was skipped: {}", unit, reason));
    for (const std::string& line : farm->why_unit(kJob, unit)) why.push_back(line);
  }
  for (const WorkerStatus& worker : status.workers)
    if (status.workers.size() < 20)
      for (const std::string& line : farm->why_worker(std::to_string(worker.id))) why.push_back(line);
  write_lines(w, "why", why);
  KILN_TRY_STATUS(write_file_atomic(wish.folder / "outcome.json", w.end_object().take()));
  return complete;
}

}  // namespace
}  // namespace kiln::test

int main(int argc, char** argv) {
  auto wish = kiln::test::read_wish(argc, argv);
  const auto done = wish ? kiln::test::bake_and_tell(*wish) : tl::unexpected<kiln::Error>(wish.error());
  if (!done) std::fprintf(stderr, "%s\n", done.error().message.c_str());
  return done && *done ? 0 : 1;
}
