// A copy of a data folder, made while it is in use: the database by SQLite's backup, at one moment between
// two groups of the writer; the spool files as they are at that moment; blobs, which never change, as hard
// links, or as verified copies where links are impossible. Tokens and certificates are not in it: they are
// secrets.
//
// Whoever has the store makes it. A program beside a coordinator leaves a request in the data folder and
// waits for the answer there.
#pragma once

#include <filesystem>
#include <optional>

#include "coordinator/farm/queue/blobs.h"
#include "coordinator/farm/queue/store.h"

namespace kiln {

struct BackedUp {
  uint64_t jobs = 0, files = 0, linked = 0;  // of the files, blobs that are links
  uint64_t bytes = 0;                        // copied
  uint64_t damaged = 0;                      // blobs that were damaged or missing, and are not in it
};

using GoesOn = std::function<bool()>;  // asked between files; false ends the backup (kUnavailable)

// `folder` must be empty or absent, and is absent if this fails.
Expected<BackedUp> back_up(Store& store, BlobStore& blobs, const std::filesystem::path& folder,
                           const GoesOn& goes_on = {});
// Whether a folder holds a whole backup.
bool is_whole_backup(const std::filesystem::path& folder);

// The last backup of a data folder, in its file `last-backup.json`.
struct BackupNote {
  int64_t at_ms = 0;  // Unix ms; 0: none is known
  BackedUp made;
};
Status note_backup(const std::filesystem::path& data, int64_t at_ms, const BackedUp& made);
BackupNote read_backup_note(const std::filesystem::path& data);

// The request of another program, and the answer to it.
Status request_backup(const std::filesystem::path& data, const std::filesystem::path& folder);
std::optional<std::filesystem::path> take_backup_request(const std::filesystem::path& data);  // once
Status answer_backup(const std::filesystem::path& data, const Expected<BackedUp>& outcome);
std::optional<Expected<BackedUp>> take_backup_answer(const std::filesystem::path& data);  // once
// Takes a request back that nobody took. False: it was taken.
bool withdraw_backup_request(const std::filesystem::path& data);

}  // namespace kiln
