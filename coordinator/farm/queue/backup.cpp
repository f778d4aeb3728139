#include "coordinator/farm/queue/backup.h"

#include <fcntl.h>
#include <unistd.h>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

// `kMark` is written last.
constexpr const char *kMark = "backup.json", *kLinks = "work/backup";
constexpr const char* kNote = "last-backup.json";
constexpr const char *kRequest = "backup-request", *kAnswer = "backup-answer";
constexpr size_t kMaxFile = 16384;

Expected<HashedFile> copy_synced(const fs::path& from, const fs::path& to) {
  const OpenFile in(from, O_RDONLY);
  if (!in.is_open()) return system_error("open", from);
  KILN_TRY_STATUS(make_folder(real_disk_calls(), to.parent_path()));
  const OpenFile out(to, O_WRONLY | O_CREAT | O_EXCL);
  if (!out.is_open()) return system_error("create", to);
  KILN_TRY(const HashedFile hashed, copy_file(in, out, real_disk_calls(), UINT64_MAX));
  KILN_TRY_STATUS(out.sync(real_disk_calls()));
  return hashed;
}

Status check_going_on(const GoesOn& goes_on) {
  if (!goes_on || goes_on()) return {};
  return fail(ErrorKind::kUnavailable,
              "the coordinator was stopped before the backup was whole: make it again");
}

Status copy_spool(const fs::path& links, const fs::path& spool, const GoesOn& goes_on, BackedUp& made) {
  KILN_TRY_STATUS(make_folder(real_disk_calls(), spool));
  for (const fs::path& job : list_folder(links))
    for (const fs::path& file : list_folder(job)) {
      KILN_TRY_STATUS(check_going_on(goes_on));
      KILN_TRY(const HashedFile copied, copy_synced(file, spool / job.filename() / file.filename()));
      ++made.files;
      made.bytes += copied.size;
    }
  return {};
}

Status copy_blob(const Digest& digest, BlobStore& blobs, const fs::path& folder, BackedUp& made) {
  const std::string hex = digest.hex();
  const fs::path target = folder / hex.substr(0, 2) / hex;
  KILN_TRY_STATUS(make_folder(real_disk_calls(), target.parent_path()));
  if (!blobs.has(digest)) {
    ++made.damaged;
    return {};
  }
  if (::link(blobs.path(digest).c_str(), target.c_str()) == 0) {
    ++made.files;
    ++made.linked;
    return {};
  }
  KILN_TRY(const HashedFile copied, copy_synced(blobs.path(digest), target));
  if (copied.digest != digest) {
    KILN_TRY(const BlobState state, blobs.verify(digest));
    fs::remove(target);
    if (state == BlobState::kIntact)
      return fail(ErrorKind::kIo, text("{} was changed while it was copied", target.string()));
    ++made.damaged;
    return {};
  }
  ++made.files;
  made.bytes += copied.size;
  return {};
}

void write_numbers(JsonWriter& w, const BackedUp& made) {
  w.pair("jobs", made.jobs).pair("files", made.files).pair("linked", made.linked).pair("bytes", made.bytes);
  w.pair("damaged", made.damaged);
}

BackedUp read_numbers(const JsonValue& json) {
  BackedUp made;
  for (const auto& [name, value] : {std::pair{"jobs", &made.jobs},
                                    {"files", &made.files},
                                    {"linked", &made.linked},
                                    {"bytes", &made.bytes},
                                    {"damaged", &made.damaged}})
    if (const JsonValue* member = json.find(name)) *value = member->whole;
  return made;
}

std::string document_of(const Expected<BackedUp>& outcome) {
  const BackedUp made = outcome.value_or(BackedUp{});
  JsonWriter w;
  w.begin_object().pair("error", outcome ? "" : outcome.error().message);
  write_numbers(w, made);
  return w.end_object().take();
}

std::optional<std::string> take_file(const fs::path& file) {
  std::error_code code;
  if (!fs::exists(file, code)) return std::nullopt;
  const auto bytes = read_file(file, kMaxFile);
  fs::remove(file, code);
  if (!bytes || code) return std::nullopt;
  return std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size());
}

Expected<BackedUp> copy_all(Store& store, BlobStore& blobs, const fs::path& folder, const fs::path& links,
                            const GoesOn& goes_on) {
  BackedUp made;
  KILN_TRY_STATUS(make_folder(real_disk_calls(), folder));
  std::error_code code;
  fs::permissions(folder, fs::perms::owner_all, code);  // scenes and results are their owner's
  if (code) return system_error("close to others", folder, code);
  KILN_TRY_STATUS(make_folder(real_disk_calls(), links));
  KILN_TRY(const std::vector<JobRecord> jobs, store.copy_now(folder / "kiln.db", links));
  made.jobs = jobs.size();
  KILN_TRY_STATUS(copy_spool(links, folder / "spool", goes_on, made));
  KILN_TRY_STATUS(make_folder(real_disk_calls(), folder / "blobs"));
  for (const Digest& digest : referenced_blobs(jobs)) {
    KILN_TRY_STATUS(check_going_on(goes_on));
    KILN_TRY_STATUS(copy_blob(digest, blobs, folder / "blobs", made));
  }
  if (fs::exists(store.folder() / "clock", code))
    KILN_TRY_STATUS(copy_synced(store.folder() / "clock", folder / "clock").map([](const HashedFile&) {}));
  KILN_TRY_STATUS(write_file_atomic(folder / kMark, document_of(made)));
  return made;
}

}  // namespace

Expected<BackedUp> back_up(Store& store, BlobStore& blobs, const fs::path& folder, const GoesOn& goes_on) {
  std::error_code code;
  if (fs::exists(folder, code) && !fs::is_empty(folder, code))
    return fail(ErrorKind::kUsage,
                text("{} is not empty: a backup is made in a folder of its own", folder.string()));
  const fs::path links = store.folder() / kLinks;
  fs::remove_all(links, code);
  auto made = copy_all(store, blobs, folder, links, goes_on);
  fs::remove_all(links, code);
  if (!made) fs::remove_all(folder, code);
  return made;
}

bool is_whole_backup(const fs::path& folder) {
  std::error_code code;
  return fs::is_regular_file(folder / kMark, code);
}

Status note_backup(const fs::path& data, int64_t at_ms, const BackedUp& made) {
  JsonWriter w;
  w.begin_object().pair("at_ms", at_ms);
  write_numbers(w, made);
  return write_file_atomic(data / kNote, w.end_object().take());
}

BackupNote read_backup_note(const fs::path& data) {
  const auto bytes = read_file(data / kNote, kMaxFile);
  if (!bytes) return {};
  const auto json = parse_json({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  const JsonValue* at = json ? json->find("at_ms") : nullptr;
  if (!at || !at->is_whole || at->negative || at->whole >= uint64_t{1} << 60) return {};
  return {static_cast<int64_t>(at->whole), read_numbers(*json)};
}

Status request_backup(const fs::path& data, const fs::path& folder) {
  take_file(data / kAnswer);  // of an earlier request
  return write_file_atomic(data / kRequest, folder.string());
}

std::optional<fs::path> take_backup_request(const fs::path& data) {
  const auto folder = take_file(data / kRequest);
  if (!folder || !folder->starts_with('/')) return std::nullopt;
  return fs::path(*folder);
}

bool withdraw_backup_request(const fs::path& data) {
  return take_file(data / kRequest).has_value();
}

Status answer_backup(const fs::path& data, const Expected<BackedUp>& outcome) {
  return write_file_atomic(data / kAnswer, document_of(outcome));
}

std::optional<Expected<BackedUp>> take_backup_answer(const fs::path& data) {
  const auto document = take_file(data / kAnswer);
  if (!document) return std::nullopt;
  const auto json = parse_json(*document);
  const JsonValue* error = json ? json->find("error") : nullptr;
  if (!error) return Expected<BackedUp>(fail(ErrorKind::kIo, "the coordinator's answer cannot be read"));
  if (!error->text.empty()) return Expected<BackedUp>(fail(ErrorKind::kIo, error->text));
  return Expected<BackedUp>(read_numbers(*json));
}

}  // namespace kiln
