// The store's health: tests writing and integrity.
#include <fcntl.h>

#include "common/base/format.h"
#include "coordinator/farm/queue/spool_record.h"
#include "coordinator/farm/queue/store_impl.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr size_t kProbeBytes = size_t{1} << 20;

// SQLite's findings, and orphaned rows.
Status check_rows(Database& database, std::vector<std::string>& faults) {
  Query query = database.ask("PRAGMA integrity_check");
  for (;;) {
    KILN_TRY(const bool row, query.next());
    if (!row) break;
    if (std::string verdict = query.string(); verdict != "ok") faults.push_back(std::move(verdict));
  }
  for (const char* sql :
       {"SELECT count(*),'results' FROM unit_results WHERE job NOT IN (SELECT id FROM jobs)",
        "SELECT count(*),'passes' FROM passes WHERE job NOT IN (SELECT id FROM jobs)",
        "SELECT count(*),'events' FROM events WHERE job NOT IN (SELECT id FROM jobs)"}) {
    Query count = database.ask(sql);
    KILN_TRY_STATUS(count.next());
    const uint64_t orphans = count.number();
    if (orphans) faults.push_back(text("{} {} belong to no job", orphans, count.string()));
  }
  return {};
}

}  // namespace

Expected<std::vector<std::string>> StoreImpl::check() {
  std::vector<std::string> faults;
  std::vector<CommitRow> rows;
  Operation operation;
  operation.reads = true;
  operation.apply = [&](GroupTransaction& t) -> Status {
    // What an earlier crash left is no fault. If the tables are damaged, the check below says where.
    (void)writer_.finish_late();
    KILN_TRY_STATUS(check_rows(t.database(), faults));
    for (const JobRecord& job : t.jobs()) {
      KILN_TRY(const auto of_job, t.tables().load_results(job.id));
      rows.insert(rows.end(), of_job.begin(), of_job.end());
    }
    return {};
  };
  KILN_TRY_STATUS(writer_.give_and_wait(std::move(operation)));
  for (const CommitRow& row : rows)
    if (const auto payload = read_result(row); !payload && cache_.has_job(row.job))
      faults.push_back(payload.error().message);
  for (const fs::path& folder : list_folder(spool_))
    for (const fs::path& file : list_folder(folder))
      if (const auto id = spool_id(file); !id || !cache_.has_job(id->job))
        faults.push_back(text("{} belongs to no job", file.string()));
  return faults;
}

Status StoreImpl::probe_spool() {
  DiskCalls& disk = options_.faults ? *options_.faults : real_disk_calls();
  const fs::path path = spool_ / "probe";
  const auto write = [&]() -> Status {
    const OpenFile file(path, O_WRONLY | O_CREAT | O_TRUNC);
    if (!file.is_open()) return system_error("create", path);
    KILN_TRY_STATUS(file.write_at(disk, Bytes(kProbeBytes), 0));
    return file.sync(disk);
  };
  Status status = write();
  std::error_code ignored;
  fs::remove(path, ignored);
  return status;
}

Status StoreImpl::probe() {
  KILN_TRY_STATUS(probe_spool());
  Operation operation;
  operation.apply = [](GroupTransaction& t) {
    return t.database().run("UPDATE about SET value=value WHERE key='release'");
  };
  return writer_.give_and_wait(std::move(operation));
}

}  // namespace kiln
