#include "worker/agent/bake_pool.h"

#include <exception>
#include <new>

#include "common/base/format.h"

namespace kiln {
namespace {

// Memory may run out in the middle of a unit: that is this machine's trouble, not the unit's.
Expected<UnitResult> bake_guarded(const Baker& baker, const WorkUnit& unit) {
  try {
    return baker.bake(unit);
  } catch (const std::bad_alloc&) {
    return fail(ErrorKind::kNoSpace,
                text("not enough memory for unit {} of {} texels", unit.id, unit.sites.size()));
  } catch (const std::exception& e) {
    return fail(ErrorKind::kInternal, text("unit {}: {}", unit.id, e.what()));
  }
}

}  // namespace

BakePool::BakePool(std::shared_ptr<const Baker> baker, unsigned threads, OnDone on_done)
    : baker_(std::move(baker)), on_done_(std::move(on_done)) {
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

void BakePool::add(Unit unit) {
  {
    const std::lock_guard lock(mutex_);
    queue_.push_back(std::move(unit));
  }
  changed_.notify_one();
}

std::vector<Unit> BakePool::take_unbegun() {
  const std::lock_guard lock(mutex_);
  std::vector<Unit> units(std::make_move_iterator(queue_.begin()), std::make_move_iterator(queue_.end()));
  queue_.clear();
  return units;
}

size_t BakePool::queued() const {
  const std::lock_guard lock(mutex_);
  return queue_.size();
}

void BakePool::run() {
  for (;;) {
    Unit unit;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return stop_ || !queue_.empty(); });
      if (stop_) return;
      unit = std::move(queue_.front());
      queue_.pop_front();
    }
    on_done_(unit, bake_guarded(*baker_, unit.unit));
  }
}

}  // namespace kiln
