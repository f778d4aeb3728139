#include "coordinator/farm/queue/store.h"

#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/farm/queue/late_checks.h"
#include "coordinator/farm/queue/schema.h"
#include "coordinator/farm/queue/store_impl.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

// Files created by open(), removed if it fails.
class NewFiles {
 public:
  ~NewFiles() {
    std::error_code ignored;
    if (!keep_)
      for (auto it = paths_.rbegin(); it != paths_.rend(); ++it) fs::remove(*it, ignored);
  }
  // Call before creating `path`.
  void expect(const fs::path& path) {
    std::error_code code;
    if (!fs::exists(path, code)) paths_.push_back(path);
  }
  void keep() { keep_ = true; }

 private:
  std::vector<fs::path> paths_;
  bool keep_ = false;
};

// The first write of a store's life.
Status begin_life(Database& database, uint64_t epoch, const std::string& release) {
  KILN_TRY_STATUS(database.begin());
  Status status = Tables(database).set_epoch(epoch, release);
  if (status) status = database.commit();
  if (!status) {
    database.rollback();
    return status;
  }
  // If a sync failed before the last exit, the log may exist only in the kernel's memory: this writes all of
  // it again.
  return database.checkpoint();
}

Expected<StoreImpl::Loaded> load(Database& database, const std::string& release) {
  Tables tables(database);
  StoreImpl::Loaded loaded;
  KILN_TRY(loaded.jobs, tables.load_jobs());
  KILN_TRY(loaded.workers, tables.load_workers());
  KILN_TRY(const uint64_t last, tables.load_epoch());
  loaded.epoch = last + 1;
  if (Status status = begin_life(database, loaded.epoch, release); !status) {
    if (status.error().kind != ErrorKind::kNoSpace) return tl::unexpected<Error>(status.error());
    log_warning(
        text("the store can be read, and takes nothing until there is space: {}", status.error().message));
    loaded.begins = [epoch = loaded.epoch, release](Database& d) { return begin_life(d, epoch, release); };
  }
  return loaded;
}

}  // namespace

Expected<std::unique_ptr<Store>> Store::open(const fs::path& given, const StoreOptions& options) {
  std::error_code code;
  const fs::path folder = fs::absolute(given, code).lexically_normal();
  const fs::path path = folder / "kiln.db", spool = folder / "spool";
  NewFiles fresh;  // undone after the lock and the database are closed
  fresh.expect(folder);
  KILN_TRY_STATUS(make_folder(real_disk_calls(), folder));
  KILN_TRY(FolderLock lock, FolderLock::take(folder));
  KILN_TRY_STATUS(check_schema(path, static_cast<uint32_t>(store_schema().size())));
  fresh.expect(spool);
  for (const char* tail : {"", "-wal", "-journal"}) fresh.expect(path.string() + tail);
  KILN_TRY(Database database, Database::open(path));
  KILN_TRY_STATUS(check_small_tables(database));
  KILN_TRY_STATUS(migrate(database, store_schema()));
  KILN_TRY_STATUS(make_folder(real_disk_calls(), spool));
  KILN_TRY(StoreImpl::Loaded loaded, load(database, options.release));
  KILN_TRY_STATUS(sync_folder(real_disk_calls(), folder));
  if (const Status status = lock.sign(); !status && status.error().kind != ErrorKind::kNoSpace)
    return tl::unexpected<Error>(status.error());
  fresh.keep();
  return std::unique_ptr<Store>(
      new StoreImpl(folder, options, std::move(lock), std::move(database), std::move(loaded)));
}

StoreImpl::StoreImpl(fs::path folder, const StoreOptions& options, FolderLock lock, Database database,
                     Loaded loaded)
    : folder_(std::move(folder)),
      spool_(folder_ / "spool"),
      options_(options),
      epoch_(loaded.epoch),
      lock_(std::move(lock)),
      cache_(std::move(loaded.jobs), std::move(loaded.workers)),
      writer_(std::move(database),
              Spool(spool_, epoch_, options.spool_file_bytes,
                    options.faults ? *options.faults : real_disk_calls()),
              cache_, options_, std::move(loaded.begins), LateChecks(spool_, epoch_, cache_.ids())) {}

void StoreImpl::close() {
  writer_.stop();
  lock_.reset();
}

Expected<Bytes> StoreImpl::read_result(JobId job, uint64_t unit, const Digest& digest) {
  if (const auto row = windows_.find(job, unit, digest))
    if (auto payload = read_result(*row)) return payload;  // else it may have been stored anew, elsewhere
  KILN_TRY(const CommitRow row, read<CommitRow>([&](GroupTransaction& t) -> Expected<CommitRow> {
             KILN_TRY(std::vector<CommitRow> rows,
                      t.tables().load_results_from(job, unit, digest, RowWindows::kRows));
             const CommitRow first = rows.front();
             windows_.put(job, std::move(rows));
             return first;
           }));
  return read_result(row);
}

Expected<std::vector<CommitRow>> StoreImpl::commits(JobId job) {
  return read<std::vector<CommitRow>>([&](GroupTransaction& t) { return t.tables().load_results(job); });
}

Expected<std::vector<PassRecord>> StoreImpl::passes(JobId job) {
  return read<std::vector<PassRecord>>([&](GroupTransaction& t) { return t.tables().load_passes(job); });
}

Expected<std::vector<JobEvent>> StoreImpl::events(JobId job) {
  return read<std::vector<JobEvent>>([&](GroupTransaction& t) { return t.tables().load_events(job); });
}

Status StoreImpl::flush() {
  Operation operation;
  operation.reads = true;
  return writer_.give_and_wait(std::move(operation));
}

Status StoreImpl::compact() {
  Operation operation;
  operation.reads = true;
  operation.after = [this]() -> Status {
    KILN_TRY_STATUS(writer_.finish_late());
    return writer_.database().checkpoint();
  };
  return writer_.give_and_wait(std::move(operation));
}

uint64_t StoreImpl::wal_size() const {
  std::error_code code;
  const uint64_t size = fs::file_size(folder_ / "kiln.db-wal", code);
  return code ? 0 : size;
}

}  // namespace kiln
