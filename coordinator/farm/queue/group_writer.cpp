#include "coordinator/farm/queue/group_writer.h"

#include <algorithm>
#include <chrono>
#include <future>
#include <set>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/log.h"

namespace kiln {
namespace {

constexpr std::chrono::seconds kIdle{1};  // after which late checks begin and the log is emptied
constexpr std::chrono::seconds kLate{
    60};  // after the opening, any moment without work is one for late checks
constexpr std::chrono::seconds kNoWait{0};

bool is_own_fault(const Error& error) {
  return error.kind == ErrorKind::kInvalidInput || error.kind == ErrorKind::kUsage;
}

}  // namespace

std::optional<JobRecord> GroupTransaction::job(JobId id) const {
  const auto it = changes_.jobs.find(id);
  return it != changes_.jobs.end() ? it->second : cache_.job(id);
}

bool GroupTransaction::has_job(JobId id) const {
  const auto it = changes_.jobs.find(id);
  return it != changes_.jobs.end() ? it->second.has_value() : cache_.has_job(id);
}

std::vector<JobRecord> GroupTransaction::jobs() const {
  std::map<JobId, JobRecord> all;
  for (JobRecord& job : cache_.jobs()) all.emplace(job.id, std::move(job));
  for (const auto& [id, job] : changes_.jobs) {
    if (job)
      all.insert_or_assign(id, *job);
    else
      all.erase(id);
  }
  std::vector<JobRecord> list;
  for (auto& [id, job] : all) list.push_back(std::move(job));
  return list;
}

std::optional<WorkerRecord> GroupTransaction::worker(const std::string& identity) const {
  const auto it = changes_.workers.find(identity);
  return it != changes_.workers.end() ? std::optional(it->second) : cache_.worker(identity);
}

GroupWriter::GroupWriter(Database database, Spool spool, RecordCache& cache, const StoreOptions& options,
                         FirstWrite first, LateChecks late)
    : database_(std::move(database)),
      spool_(std::move(spool)),
      cache_(cache),
      options_(options),
      first_(std::move(first)),
      late_(std::move(late)) {
  thread_ = std::thread([this] { run(); });
}

void GroupWriter::give(Operation operation) {
  KILN_CHECK(!(operation.reads && operation.removes));
  {
    const std::lock_guard lock(mutex_);
    if (!stopping_) {
      queue_.push_back(std::move(operation));
      wake_.notify_one();
      return;
    }
  }
  if (operation.done) operation.done(fail(ErrorKind::kUnavailable, "the store is closed"));
}

Status GroupWriter::give_and_wait(Operation operation) {
  KILN_CHECK(std::this_thread::get_id() != thread_.get_id());
  std::promise<Status> promise;
  operation.done = [&](Status status) { promise.set_value(std::move(status)); };
  give(std::move(operation));
  return promise.get_future().get();
}

void GroupWriter::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    wake_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

void GroupWriter::run() {
  bool idle = false;  // late checks go on until there is work
  for (;;) {
    std::unique_lock lock(mutex_);
    const bool overdue = late_.left() && std::chrono::steady_clock::now() - opened_ > kLate;
    const auto work_or_end = [this] { return stopping_ || !queue_.empty(); };
    const bool work = wake_.wait_for(lock, idle || overdue ? kNoWait : kIdle, work_or_end);
    if (work && queue_.empty()) break;  // stopping
    idle = !work && late_.left();
    if (idle) {
      lock.unlock();
      late_step();
      continue;
    }
    std::vector<Operation> group = take_group(lock);
    lock.unlock();
    if (!group.empty()) write_group(group);
    compact_if_over(group.empty() ? 1 : options_.wal_bytes);
  }
  compact_if_over(1);
  database_.close();
}

std::vector<Operation> GroupWriter::take_group(std::unique_lock<std::mutex>& lock) {
  KILN_CHECK(lock.owns_lock());
  std::vector<Operation> group;
  uint64_t bytes = 0;
  while (!queue_.empty() && group.size() < options_.group_operations) {
    const Operation& next = queue_.front();
    const uint64_t size = next.payload ? next.payload->bytes->size() : 0;
    if (!group.empty() && bytes + size > options_.group_bytes) break;
    bytes += size;
    group.push_back(std::move(queue_.front()));
    queue_.pop_front();
    if (group.back().after) break;
  }
  return group;
}

void GroupWriter::late_step() {
  const Status status = late_.step(database_);
  if (status || !damage_) return;
  damage_ = status;
  log_error(text("nothing is stored any more: {}", status.error().message));
}

Status GroupWriter::finish_late() {
  while (late_.left()) late_step();
  return damage_;
}

bool GroupWriter::begin_writing(std::span<Operation> group) {
  for (Operation& operation : group)
    if (!damage_ && !operation.reads) operation.status = damage_;
  if (!damage_) return false;
  if (!first_) return true;
  if (std::all_of(group.begin(), group.end(), [](const Operation& o) { return o.reads; })) return true;
  const Status status = first_(database_);
  if (status) first_ = nullptr;
  for (Operation& operation : group)
    if (!status && !operation.reads) operation.status = status;
  return status.has_value();
}

void GroupWriter::write_group(std::vector<Operation>& group) {
  KILN_CHECK(!group.empty());
  if (begin_writing(group)) write_payloads(group);
  std::vector<Operation*> open;
  for (Operation& operation : group)
    if (operation.status) open.push_back(&operation);

  Status status = make_room_in_log(group);
  if (status) status = attempt(open);
  if (!status && status.error().kind == ErrorKind::kInternal && open.size() > 1) {
    // SQLite rejected one statement: the other operations must not fail with it.
    for (Operation* operation : open)
      if (Status alone = attempt({&operation, 1}); !alone) operation->status = alone;
  } else if (!status) {
    // The disk failed. Reads need no space.
    std::vector<Operation*> reads;
    for (Operation* operation : open) {
      operation->status = status;
      if (operation->reads) reads.push_back(operation);
    }
    if (Status again = attempt(reads); !again)
      for (Operation* operation : reads) operation->status = again;
  }

  for (Operation& operation : group) {
    if (operation.status && operation.after) operation.status = operation.after();
    if (operation.done) operation.done(std::move(operation.status));
  }
}

void GroupWriter::write_payloads(std::span<Operation> group) {
  Tables tables(database_);
  // Stored results may be gone when their turn comes: all of them, or those that an earlier operation
  // replaces.
  bool removed = false;
  std::set<std::pair<JobId, uint64_t>> replaced;
  for (Operation& operation : group) {
    removed = removed || operation.removes;
    if (!operation.payload) continue;
    const UnitCommit& commit = operation.payload->commit;
    KILN_CHECK(operation.payload->bytes != nullptr);
    operation.payload->place.reset();
    if (!cache_.has_job(commit.job)) continue;  // apply() will report it
    if (!removed && !replaced.count({commit.job, commit.unit})) {
      const Expected<bool> known = tables.has_result(commit);
      if (known && *known) continue;
    }
    const Expected<SpoolPlace> place = spool_.append(commit, *operation.payload->bytes);
    if (!place) {
      operation.status = tl::unexpected<Error>(place.error());
      continue;
    }
    operation.payload->place = *place;
    replaced.insert({commit.job, commit.unit});
  }
  const std::map<JobId, Error> failed = spool_.sync();
  for (Operation& operation : group) {
    if (!operation.payload || !operation.payload->place) continue;
    const auto it = failed.find(operation.payload->commit.job);
    if (it != failed.end()) operation.status = tl::unexpected<Error>(it->second);
  }
}

Status GroupWriter::make_room_in_log(std::span<const Operation> group) {
  if (database_.wal_size() < options_.wal_bytes) return {};
  // The log could not be emptied after the last group. Operations that free space may still run.
  for (const Operation& operation : group)
    if (operation.removes) return {};
  return database_.checkpoint();
}

Status GroupWriter::attempt(std::span<Operation* const> operations) {
  if (operations.empty()) return {};
  GroupTransaction transaction(database_, cache_);
  KILN_TRY_STATUS(database_.begin());
  for (Operation* operation : operations) {
    operation->status = operation->apply ? operation->apply(transaction) : Status();
    if (operation->status || operation->reads || is_own_fault(operation->status.error())) continue;
    Status status = operation->status;
    database_.rollback();
    return status;
  }
  if (Status status = database_.commit(); !status) {
    database_.rollback();
    return status;
  }
  cache_.apply(transaction.take_changes());
  return {};
}

void GroupWriter::compact_if_over(uint64_t bytes) {
  if (database_.wal_size() < bytes) return;
  const Status status = database_.checkpoint();
  if (!status && !warned_) log_warning(text("the log cannot be emptied: {}", status.error().message));
  warned_ = !status;
}

}  // namespace kiln
