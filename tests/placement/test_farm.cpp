// kiln-test-farm FOLDER UNITS LOCAL_WORKERS: a coordinator on 127.0.0.1 that writes FOLDER/address, takes the
// token in FOLDER/token, bakes UNITS units of the test job and prints "digest ..." of all results in the
// order of units, "workers lost ..." and what happened.
#include <cstdio>

#include "common/base/files.h"
#include "common/base/format.h"
#include "tests/farm/farm_support.h"

namespace kiln::test {
namespace {

Status bake_and_print(const std::filesystem::path& folder, size_t units, uint32_t local_workers) {
  const TestJob job;
  FarmSettings settings = stub_settings(local_workers);
  settings.others_may_come = true;
  KILN_TRY(const Bytes token, read_file(folder / "token", 4096));
  settings.token.assign(reinterpret_cast<const char*>(token.data()), token.size());
  KILN_TRY(auto farm, start_farm(settings, job));
  KILN_TRY_STATUS(write_file_atomic(folder / "address", text("127.0.0.1:{}\n", farm.farm->port())));
  std::map<uint64_t, Digest> results;
  const auto keep = [&](const WorkUnit& unit, const UnitResult& result) -> Status {
    results[unit.id] = result_digest(result);
    KILN_TRY_STATUS(write_file_atomic(folder / "done", text("{}\n", results.size())));
    return {};
  };
  KILN_TRY(const PassEnd end, farm.job->run_pass(make_units(1, units), 0, {keep, {}, {}}));
  if (end != PassEnd::kComplete || results.size() != units)
    return fail(ErrorKind::kInternal, "the pass is not complete");
  Sha256 all;
  for (const auto& [unit, digest] : results) all.add(std::as_bytes(std::span(digest.bytes)));
  std::printf("digest %s\nworkers lost %llu\n", all.finish().hex().c_str(),
              static_cast<unsigned long long>(farm.job->statistics().workers_lost));
  for (const std::string& event : farm.job->statistics().events) std::printf("%s\n", event.c_str());
  return {};
}

}  // namespace
}  // namespace kiln::test

int main(int argc, char** argv) {
  if (argc != 4) return std::fputs("kiln-test-farm FOLDER UNITS LOCAL_WORKERS\n", stderr), 2;
  const auto done = kiln::test::bake_and_print(argv[1], std::stoul(argv[2]), std::stoul(argv[3]));
  if (!done) std::fprintf(stderr, "%s\n", done.error().message.c_str());
  return done ? 0 : 1;
}
