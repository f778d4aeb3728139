#include "coordinator/farm/queue/backup.h"

#include <chrono>
#include <cstdio>
#include <filesystem>
#include <thread>

#include "common/base/format.h"
#include "coordinator/cli/command.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr auto kLook = std::chrono::milliseconds(200);
constexpr int kLooksUntilTaken = 150;  // half a minute

// The coordinator that has the folder makes it.
Expected<BackedUp> ask_coordinator(const fs::path& data, const fs::path& folder) {
  KILN_TRY_STATUS(request_backup(data, folder));
  for (int looks = 0;; ++looks) {
    std::this_thread::sleep_for(kLook);
    if (auto answer = take_backup_answer(data)) return std::move(*answer);
    if (looks == kLooksUntilTaken && withdraw_backup_request(data))
      return fail(ErrorKind::kUnavailable,
                  text("the coordinator of {} did not take the request within half a minute: is it an older "
                       "release? Stop it and ask again",
                       data.string()));
  }
}

Expected<BackedUp> make_backup(const fs::path& data, const fs::path& folder) {
  std::error_code code;
  if (!fs::exists(data / "kiln.db", code))
    return fail(ErrorKind::kUsage,
                text("{} holds no kiln.db: give the folder of `kiln serve --data`", data.string()));
  auto store = Store::open(data, {});
  if (!store && store.error().kind == ErrorKind::kUnavailable) return ask_coordinator(data, folder);
  if (!store) return tl::unexpected<Error>(store.error());
  KILN_TRY(const auto blobs, BlobStore::open(data / "blobs", {}));
  KILN_TRY(const BackedUp made, back_up(**store, *blobs, folder));
  using namespace std::chrono;
  const int64_t now_ms = duration_cast<milliseconds>(system_clock::now().time_since_epoch()).count();
  KILN_TRY_STATUS(note_backup(data, now_ms, made));
  return made;
}

int run(const Arguments& a, const BakeSettings&) {
  std::error_code code;
  const fs::path data = fs::absolute(a.get("data"), code).lexically_normal(),
                 folder = fs::absolute(a.get("output"), code).lexically_normal();
  const auto made = make_backup(data, folder);
  if (!made) return report_error(made.error());
  std::printf("%s: %llu jobs, %llu files, %llu of them links, %.1f MiB copied\n", folder.c_str(),
              static_cast<unsigned long long>(made->jobs), static_cast<unsigned long long>(made->files),
              static_cast<unsigned long long>(made->linked), static_cast<double>(made->bytes) / 1048576);
  if (made->damaged == 0) return 0;
  return report_error(
      {ErrorKind::kIo, text("{} files are damaged or missing and not in the backup: see the "
                            "coordinator's log, or stop it and run `kiln doctor --data {} --deep`",
                            made->damaged, data.string())});
}

}  // namespace

Command backup_command() {
  return {
      "backup",
      "Copy a coordinator's data folder while it is in use; `kiln serve --data COPY` goes on from it",
      "kiln backup --data /srv/kiln -o /backup/kiln-monday\n  kiln doctor --backup /backup/kiln-monday",
      {{"--data", "DIR", "folder of the coordinator, on this machine", true},
       {"-o,--output", "DIR", "folder of the copy: empty or absent, where the coordinator may write", true}},
      false,
      run};
}

}  // namespace kiln
