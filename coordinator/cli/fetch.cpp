#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <set>

#include "common/base/format.h"
#include "coordinator/cli/service_options.h"
#include "coordinator/run/publish_folder.h"

namespace kiln {
namespace fs = std::filesystem;

Status fetch_results(ServiceClient& client, uint64_t job, const std::string& folder, bool quiet) {
  KILN_TRY(const std::string reply, client.call("fetch", id_document(job)));
  KILN_TRY(const JsonValue answer, parse_json(reply));
  const JsonValue* files = answer.find("files");
  if (!files) return fail(ErrorKind::kProtocol, "the coordinator's answer to fetch has no files");
  std::error_code code;
  fs::create_directories(folder, code);
  if (code) return fail(ErrorKind::kIo, text("cannot make {}: {}", folder, code.message()));
  std::vector<const JsonValue*> wanted;
  std::set<std::string> names;
  for (const JsonValue& file : files->items) {
    const JsonValue* name = file.find("path");
    const std::string path = text_of(file, "path");
    // Results are plain file names; anything else might lie outside this folder, or steer a terminal.
    if (path.empty() || path.find('/') != std::string::npos || path.front() == '.' || path != name->text)
      return fail(ErrorKind::kProtocol,
                  text("the coordinator names a result '{}', which is not a file name", path));
    wanted.push_back(&file);
    if (path != "report.json") names.insert(path);
  }
  // Nothing of an earlier bake stays. report.json comes last: a folder that has one is whole.
  KILN_TRY_STATUS(remove_earlier_bake(folder, names));
  std::stable_partition(wanted.begin(), wanted.end(),
                        [](const JsonValue* file) { return text_of(*file, "path") != "report.json"; });
  for (const JsonValue* one : wanted) {
    const JsonValue& file = *one;
    const std::string path = text_of(file, "path");
    KILN_TRY(const Digest digest, Digest::from_hex(text_of(file, "digest")));
    KILN_TRY_STATUS(
        client.download({job, path, digest, whole_of(file, "size")}, fs::path(folder) / path, {}));
    if (!quiet) std::printf("%s/%s\n", folder.c_str(), path.c_str());
  }
  if (flag_of(answer, "tainted"))
    std::fprintf(stderr, "kiln: warning: the result is tainted: %s\n", text_of(answer, "taint").c_str());
  if (const std::string checked = text_of(answer, "verification"); !quiet && !checked.empty())
    std::printf("checked: %s\n", checked.c_str());
  return {};
}

namespace {

int run(const Arguments& a, const BakeSettings&) {
  const Status s = [&]() -> Status {
    KILN_TRY(const uint64_t id, parse_id(a.get("id")));
    KILN_TRY(const std::unique_ptr<ServiceClient> client, connect_service(a));
    KILN_TRY_STATUS(fetch_results(*client, id, a.get("output"), a.has("json")));
    if (a.has("json")) std::fputs(id_document(id).c_str(), stdout);
    return {};
  }();
  return s ? 0 : report_error(s.error());
}

}  // namespace

Command fetch_command() {
  return {"fetch",
          "Download the results of a finished job; resumes an interrupted download",
          "kiln fetch 12 -o out",
          with_service_options({{"id", "ID", "the job's number", true},
                                {"-o,--output", "DIR", "output folder, created if needed", true}}),
          false,
          run};
}

}  // namespace kiln
