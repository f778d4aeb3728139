#include "worker/agent/bake_pool.h"

#include <algorithm>
#include <exception>
#include <new>

#include "common/base/format.h"
#include "worker/agent/crash_note.h"

namespace kiln {
namespace {

// Memory may run out in the middle of a unit: the machine's problem, not the unit's.
Expected<UnitResult> bake_guarded(const BakeTask& task) {
  const WorkUnit& unit = task.unit.unit;
  try {
    const IrradianceCache* cache = nullptr;
    if (task.cache) {
      KILN_TRY(cache, task.cache->get());
    }
    return task.baker->bake(unit, cache);
  } catch (const std::bad_alloc&) {
    return fail(ErrorKind::kNoSpace,
                text("not enough memory for unit {} of {} texels", unit.id, unit.sites.size()));
  } catch (const std::exception& e) {
    return fail(ErrorKind::kInternal, text("unit {}: {}", unit.id, e.what()));
  }
}

}  // namespace

BakePool::BakePool(unsigned threads, OnDone on_done) : on_done_(std::move(on_done)) {
  for (unsigned t = 0; t < threads; ++t) team_.emplace_back([this] { run(); });
}

BakePool::~BakePool() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
    queue_.clear();
  }
  changed_.notify_all();
}

void BakePool::add(BakeTask task) {
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back(std::move(task));
  }
  changed_.notify_one();
}

std::vector<Unit> BakePool::take_unbegun(const std::function<bool(const Unit&)>& wanted) {
  const std::lock_guard lock(mutex_);
  std::vector<Unit> units;
  const auto kept = std::stable_partition(queue_.begin(), queue_.end(),
                                          [&](const BakeTask& task) { return !wanted(task.unit); });
  for (auto it = kept; it != queue_.end(); ++it) units.push_back(std::move(it->unit));
  queue_.erase(kept, queue_.end());
  return units;
}

size_t BakePool::queued() const {
  const std::lock_guard lock(mutex_);
  return queue_.size();
}

std::optional<BakePool::Begun> BakePool::oldest() const {
  const std::lock_guard lock(mutex_);
  if (begun_.empty()) return std::nullopt;
  return begun_.front();
}

void BakePool::run() {
  use_crash_stack();
  for (;;) {
    BakeTask task;
    std::list<Begun>::iterator begun;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return stop_ || !queue_.empty(); });
      if (stop_) return;
      task = std::move(queue_.front());
      queue_.pop_front();
      begun = begun_.insert(begun_.end(), {task.unit.job, task.unit.unit.id, clock_.now_ms()});
    }
    auto result = [&] {
      const CrashNote note(task.replay_file, task.replay);
      return bake_guarded(task);
    }();
    {
      const std::lock_guard lock(mutex_);
      begun_.erase(begun);
    }
    task.cache.reset();
    task.baker.reset();  // before the unit is reported done, so that an evicted scene is freed by then
    on_done_(task.unit, std::move(result));
  }
}

}  // namespace kiln
