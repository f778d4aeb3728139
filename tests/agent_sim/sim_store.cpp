#include "tests/agent_sim/sim_store.h"

namespace kiln::sim {

void SimStore::put(const StoreAnswer& a, std::shared_ptr<const UnitResult> result,
                   std::function<void()> stored) {
  const auto payload = std::make_shared<const Bytes>(write_result(*result));
  const UnitCommit commit{a.job, a.unit, a.shape, a.digest, a.identity, false};
  give({[this, commit, payload](Store::Callback done) {
          store_.commit_result(commit, payload, std::move(done));
        },
        std::move(stored)});
}

void SimStore::settle(const Settle& s) {
  give({[this, s](Store::Callback done) {
          store_.settle(s.job, s.unit, s.digest, s.verified, s.identity, std::move(done));
        },
        {}});
}

void SimStore::revoke(const Revoke& r) {
  give({[this, r](Store::Callback done) { store_.revoke_answer(r.job, r.unit, r.digest, std::move(done)); },
        {}});
}

void SimStore::pin_class(JobId job, const std::string& numeric_class) {
  give({[this, job, numeric_class](Store::Callback done) {
          store_.pin_class(job, numeric_class, std::move(done));
        },
        {}});
}

Expected<std::shared_ptr<const UnitResult>> SimStore::read(JobId job, uint64_t unit, const Digest& digest) {
  KILN_TRY(const Bytes bytes, store_.read_result(job, unit, digest));
  KILN_TRY(UnitResult result, read_result(bytes));
  return std::make_shared<const UnitResult>(std::move(result));
}

void SimStore::give(Operation operation) {
  queue_.push_back(std::move(operation));
  if (std::exchange(writing_, true)) return;
  timing_.later(1 + static_cast<int64_t>(timing_.clock().draw(5)), [this] { write(); });
}

// The store's thread works while this one waits, and on one operation at a time: how many of several it takes
// together is a matter of luck, and the seed decides everything.
void SimStore::write() {
  std::vector<Status> outcomes(queue_.size());
  for (size_t i = 0; i < queue_.size(); ++i) {
    queue_[i].attempt([&outcomes, i](Status status) { outcomes[i] = std::move(status); });
    (void)store_.flush();
  }
  std::vector<std::function<void()>> stored;
  size_t done = 0;
  for (; done < outcomes.size(); ++done) {
    const Status& status = outcomes[done];
    // A row that is gone is no fault of the disk.
    if (!status && status.error().kind != ErrorKind::kInvalidInput) break;
    if (status && queue_[done].stored) stored.push_back(std::move(queue_[done].stored));
  }
  const bool refused = done < outcomes.size();
  refused_ += refused;
  queue_.erase(queue_.begin(), queue_.begin() + static_cast<ptrdiff_t>(done));
  writing_ = !queue_.empty();
  if (writing_) timing_.later(refused ? 50 : 1, [this] { write(); });
  if (std::exchange(held_, refused) != refused) on_hold_(refused);
  for (const auto& call : stored) call();
}

void SimStore::begin_and_die() {
  for (Operation& operation : queue_) {
    operation.attempt([](Status) {});
    (void)store_.flush();
  }
  queue_.clear();
}

}  // namespace kiln::sim
