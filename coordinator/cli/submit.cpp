#include <cstdio>
#include <map>

#include "common/base/format.h"
#include "coordinator/cli/service_options.h"
#include "coordinator/farm/snapshot/snapshot.h"
#include "coordinator/service/job_settings.h"

namespace kiln {
namespace {

Expected<std::string> manifest(const Arguments& a, const Snapshot& snapshot) {
  JsonWriter w;
  // Generated here, so that a retry after a lost reply does not create a second job.
  w.begin_object().pair("key", random_hex(16)).pair("scene", snapshot.scene);
  if (a.has("name")) w.pair("name", a.get("name"));
  if (a.has("priority")) {
    KILN_TRY(const int64_t priority, parse_whole("--priority", a.get("priority"), -100, 100));
    w.pair("priority", priority);
  }
  if (a.has("quorum")) {
    KILN_TRY(const int64_t quorum, parse_whole("--quorum", a.get("quorum"), 1, 16));
    w.pair("quorum", quorum);
  }
  if (a.has("on-poison")) w.pair("on_poison", a.get("on-poison"));
  const std::string after = a.get("after");
  w.key("after").begin_array();
  for (size_t at = 0; at < after.size();) {
    const size_t end = std::min(after.find(',', at), after.size());
    KILN_TRY(const uint64_t id, parse_id(after.substr(at, end - at)));
    w.value(id);
    at = end + 1;
  }
  w.end_array().pair("settings", write_job_settings(snapshot.settings)).key("inputs").begin_array();
  for (const FileRecord& f : snapshot.files)
    w.begin_object().pair("path", f.path).pair("digest", f.digest.hex()).pair("size", f.size).end_object();
  return w.end_array().end_object().take();
}

Status send_missing(ServiceClient& client, const Snapshot& snapshot, const JsonValue& missing, bool quiet) {
  std::map<Digest, size_t> places;
  for (size_t i = 0; i < snapshot.files.size(); ++i) places[snapshot.files[i].digest] = i;
  for (const JsonValue& wanted : missing.items) {
    KILN_TRY(const Digest digest, Digest::from_hex(wanted.text));
    const auto place = places.find(digest);
    if (place == places.end())
      return fail(ErrorKind::kProtocol, "the coordinator asks for a file that is not part of the job");
    const FileRecord& file = snapshot.files[place->second];
    if (!quiet)
      std::fprintf(stderr, "sending %s, %.1f MiB\n", file.path.c_str(),
                   static_cast<double>(file.size) / 1048576);
    KILN_TRY_STATUS(client.upload(snapshot.sources[place->second], digest, file.size, {}));
  }
  return {};
}

Expected<uint64_t> submit(ServiceClient& client, const std::string& document, const Snapshot& snapshot,
                          bool quiet) {
  // A blob may disappear between two requests if another job was just forgotten, so try more than once.
  for (int round = 0; round < 4; ++round) {
    KILN_TRY(const std::string reply, client.call("submit", document));
    KILN_TRY(const JsonValue answer, parse_json(reply));
    if (const uint64_t id = whole_of(answer, "id")) {
      if (const std::string note = text_of(answer, "note"); !note.empty())
        std::fprintf(stderr, "kiln: warning: %s\n", note.c_str());
      return id;
    }
    const JsonValue* missing = answer.find("missing");
    if (!missing || missing->items.empty()) break;
    KILN_TRY_STATUS(send_missing(client, snapshot, *missing, quiet));
  }
  return fail(ErrorKind::kProtocol, "the coordinator keeps losing uploaded files: see its log");
}

Expected<int> submit_scene(const Arguments& a, const BakeSettings& settings) {
  if (a.has("output") && !a.has("wait"))
    return fail(ErrorKind::kUsage, "-o needs --wait; or use `kiln fetch` later");
  const bool quiet = a.has("json");
  KILN_TRY(const Snapshot snapshot,
           take_snapshot(a.get("scene"), settings, {a.has("allow-outside"), !a.has("config")}));
  KILN_TRY(const std::string document, manifest(a, snapshot));
  KILN_TRY(const std::unique_ptr<ServiceClient> client, connect_service(a));
  KILN_TRY(const uint64_t id, submit(*client, document, snapshot, quiet));
  if (quiet)
    std::fputs(id_document(id).c_str(), stdout);
  else
    std::printf("job %llu\n", static_cast<unsigned long long>(id));
  std::fflush(stdout);
  if (!a.has("wait")) {
    if (!quiet)
      std::printf("next: kiln watch %llu, kiln fetch %llu -o DIR\n", static_cast<unsigned long long>(id),
                  static_cast<unsigned long long>(id));
    return 0;
  }
  KILN_TRY(const int status, watch_jobs(*client, id, quiet));
  if (status == 0 && a.has("output")) KILN_TRY_STATUS(fetch_results(*client, id, a.get("output"), quiet));
  return status;
}

int run(const Arguments& a, const BakeSettings& settings) {
  const auto status = submit_scene(a, settings);
  return status ? *status : report_error(status.error());
}

}  // namespace

Command submit_command() {
  return {"submit",
          "Submit a scene to a coordinator's queue; files that it already has are not sent again",
          "kiln submit scene.glb --texels-per-metre 8 --name hall --priority 10 --wait -o out",
          with_service_options(
              {{"scene", "SCENE", "glTF 2.0 file (.gltf or .glb)", true},
               {"--name", "NAME", "display name of the job [the scene's file]"},
               {"--priority", "P", "-100 to 100 [0]"},
               {"--after", "IDS", "jobs that must finish first, separated by commas"},
               {"--quorum", "Q",
                "owners, or machines where workers share one token, that must agree on every unit [1]"},
               {"--on-poison", "WORD",
                "when a unit fails on every worker: fail the job, or skip the unit [fail]"},
               {"--allow-outside", "",
                "send files outside the scene's folder too, which the scene leads to by links or "
                "names in SCENE.kiln.json"},
               {"--wait", "", "wait until the job has ended; the exit status is its outcome"},
               {"-o,--output", "DIR", "with --wait: fetch the results"}}),
          true,
          run};
}

}  // namespace kiln
