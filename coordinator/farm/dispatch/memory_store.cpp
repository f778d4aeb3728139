#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/dispatch/result_store.h"

namespace kiln {

void MemoryResultStore::put(const StoreAnswer& answer, std::shared_ptr<const UnitResult> result,
                            std::function<void()> stored) {
  KILN_CHECK(result && result->unit == answer.unit);
  {
    const std::lock_guard lock(mutex_);
    answers_[{answer.job, answer.unit, answer.digest}] = std::move(result);
  }
  stored();
}

void MemoryResultStore::settle(const Settle& settle) {
  const std::lock_guard lock(mutex_);
  auto it = answers_.lower_bound({settle.job, settle.unit, Digest{}});
  while (it != answers_.end() && std::get<0>(it->first) == settle.job &&
         std::get<1>(it->first) == settle.unit)
    it = revocable_ && std::get<2>(it->first) == settle.digest ? std::next(it) : answers_.erase(it);
}

void MemoryResultStore::revoke(const Revoke& revoke) {
  const std::lock_guard lock(mutex_);
  answers_.erase({revoke.job, revoke.unit, revoke.digest});
}

void MemoryResultStore::end_job(JobId job) {
  const std::lock_guard lock(mutex_);
  std::erase_if(answers_, [&](const auto& entry) { return std::get<0>(entry.first) == job; });
}

Expected<std::shared_ptr<const UnitResult>> MemoryResultStore::read(JobId job, uint64_t unit,
                                                                    const Digest& digest) {
  const std::lock_guard lock(mutex_);
  const auto it = answers_.find({job, unit, digest});
  if (it == answers_.end())
    return fail(ErrorKind::kInternal, text("the result of unit {} of job {} is not in memory", unit, job));
  return it->second;
}

}  // namespace kiln
