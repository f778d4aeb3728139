#include "coordinator/service/durable_results.h"

#include <future>

#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/service/unix_time.h"

namespace kiln {
namespace {

constexpr size_t kBatch = 1024;
constexpr auto kFirstPause = std::chrono::milliseconds(250), kLongestPause = std::chrono::milliseconds(5000);

// The operation fails whatever the disk does, for example because its job was forgotten.
bool is_own_fault(const Error& error) {
  return error.kind == ErrorKind::kInvalidInput || error.kind == ErrorKind::kUsage;
}

}  // namespace

DurableResultStore::DurableResultStore(Store& store, Hooks hooks) : store_(store), hooks_(std::move(hooks)) {
  thread_ = std::thread([this] { run(); });
}

void DurableResultStore::stop() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  wake_.notify_all();
  if (thread_.joinable()) thread_.join();
}

void DurableResultStore::give(Operation operation) {
  {
    const std::lock_guard lock(mutex_);
    if (stopping_) return;
    queue_.push_back(std::move(operation));
  }
  wake_.notify_one();
}

void DurableResultStore::put(const StoreAnswer& a, std::shared_ptr<const UnitResult> result,
                             std::function<void()> stored) {
  const auto payload = std::make_shared<const Bytes>(write_result(*result));
  const UnitCommit commit{a.job, a.unit, a.shape, a.digest, a.identity, false};
  give({[this, commit, payload](Store::Callback done) {
          store_.commit_result(commit, payload, std::move(done));
        },
        std::move(stored), a.job});
}

void DurableResultStore::settle(const Settle& s) {
  give({[this, s](Store::Callback done) {
          store_.settle(s.job, s.unit, s.digest, s.verified, s.identity, std::move(done));
        },
        {}});
}

void DurableResultStore::revoke(const Revoke& r) {
  give({[this, r](Store::Callback done) { store_.revoke_answer(r.job, r.unit, r.digest, std::move(done)); },
        {}});
}

void DurableResultStore::pin_class(JobId job, const std::string& numeric_class) {
  give({[this, job, numeric_class](Store::Callback done) {
          store_.pin_class(job, numeric_class, std::move(done));
        },
        {}});
}

void DurableResultStore::trust(const Trust& t) {
  give({[this, t](Store::Callback done) {
          store_.note_trust(t.identity, t.agreed, unix_ms(), std::move(done));
        },
        {}});
}

void DurableResultStore::quarantine(const Quarantine& q) {
  give({[this, q](Store::Callback done) {
          store_.quarantine(q.identity, q.reason, unix_ms(), std::move(done));
        },
        {}});
}

Expected<std::shared_ptr<const UnitResult>> DurableResultStore::read(JobId job, uint64_t unit,
                                                                     const Digest& digest) {
  KILN_TRY(const Bytes bytes, store_.read_result(job, unit, digest));
  KILN_TRY(UnitResult result, read_result(bytes));
  return std::make_shared<const UnitResult>(std::move(result));
}

void DurableResultStore::suspect() {
  give({[this](Store::Callback done) { done(store_.probe()); }, {}});
}

void DurableResultStore::hold(const std::string& reason) {
  held_ = true;
  hooks_.on_hold(reason);
  suspect();
}

uint64_t DurableResultStore::stored(JobId job) const {
  const std::lock_guard lock(mutex_);
  const auto it = stored_.find(job);
  return it == stored_.end() ? 0 : it->second;
}

bool DurableResultStore::drain(std::chrono::milliseconds patience) {
  std::unique_lock lock(mutex_);
  return idle_.wait_for(lock, patience, [this] { return queue_.empty() && !busy_; });
}

// Order matters: a revoked answer must not come back because its write was retried later. So after a failure
// everything from there on is written again, which changes nothing for what was written already.
std::string DurableResultStore::write(std::deque<Operation>& batch) {
  std::vector<Status> outcomes(batch.size());
  const auto all = std::make_shared<std::promise<void>>();  // must outlive the last callback's call
  std::atomic<size_t> left = batch.size();
  for (size_t i = 0; i < batch.size(); ++i)
    batch[i].attempt([&outcomes, &left, all, i](Status status) {
      outcomes[i] = std::move(status);
      if (--left == 0) all->set_value();
    });
  all->get_future().get();
  size_t first_failed = batch.size();
  std::string reason;
  for (size_t i = 0; i < batch.size(); ++i) {
    if (outcomes[i]) {
      if (!batch[i].stored) continue;
      {
        const std::lock_guard lock(mutex_);
        ++stored_[batch[i].job];
      }
      std::exchange(batch[i].stored, {})();
    } else if (is_own_fault(outcomes[i].error())) {
      log_warning(outcomes[i].error().message);
      batch[i].stored = {};
    } else if (first_failed == batch.size()) {
      first_failed = i;
      reason = outcomes[i].error().message;
    }
  }
  batch.erase(batch.begin(), batch.begin() + static_cast<ptrdiff_t>(first_failed));
  return reason;
}

void DurableResultStore::run() {
  auto pause = kFirstPause;
  std::unique_lock lock(mutex_);
  for (;;) {
    wake_.wait(lock, [this] { return stopping_ || !queue_.empty(); });
    if (stopping_) return;
    std::deque<Operation> batch;
    while (!queue_.empty() && batch.size() < kBatch) {
      batch.push_back(std::move(queue_.front()));
      queue_.pop_front();
    }
    busy_ = true;
    lock.unlock();
    const std::string reason = write(batch);
    if (reason.empty()) {
      if (held_.exchange(false)) hooks_.on_hold("");
      pause = kFirstPause;
      lock.lock();
    } else {
      if (!held_.exchange(true)) hooks_.on_hold(reason);
      lock.lock();
      queue_.insert(queue_.begin(), std::make_move_iterator(batch.begin()),
                    std::make_move_iterator(batch.end()));
      for (bool works = false; !works && !stopping_;) {
        wake_.wait_for(lock, pause, [this] { return stopping_; });
        pause = std::min(pause * 2, kLongestPause);
        if (stopping_) break;
        lock.unlock();
        works = store_.probe().has_value();
        lock.lock();
      }
    }
    busy_ = false;
    if (queue_.empty()) idle_.notify_all();
  }
}

}  // namespace kiln
