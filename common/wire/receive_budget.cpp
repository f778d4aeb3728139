#include "common/wire/receive_budget.h"

#include <utility>

#include "common/base/check.h"

namespace kiln {

std::shared_ptr<ReceiveBudget> ReceiveBudget::make(size_t total, size_t per_caller) {
  KILN_CHECK(per_caller <= total);
  return std::shared_ptr<ReceiveBudget>(new ReceiveBudget(total, per_caller));
}

std::unique_ptr<ReceiveBudget::Share> ReceiveBudget::reserve(const std::shared_ptr<ReceiveBudget>& budget,
                                                             const std::string& caller, size_t bytes,
                                                             std::function<void()> on_granted) {
  std::unique_ptr<Share> share(new Share(budget, caller, bytes));
  share->on_granted_ = std::move(on_granted);
  share->place_ = budget->waiting_.insert(budget->waiting_.end(), share.get());
  budget->grant_waiting();
  return share;
}

// Alone, any message fits: frames are capped far below what one message may take.
bool ReceiveBudget::within_part(const Share& share) const {
  const auto held = by_caller_.find(share.caller_);
  return held == by_caller_.end() || held->second + share.bytes_ <= per_caller_;
}

void ReceiveBudget::grant(Share& share) {
  KILN_CHECK(!share.granted_);
  waiting_.erase(share.place_);
  share.granted_ = true;
  reserved_ += share.bytes_;
  by_caller_[share.caller_] += share.bytes_;
  const auto granted = std::exchange(share.on_granted_, nullptr);
  granted();
}

void ReceiveBudget::give_back(Share& share) {
  if (!share.granted_) {
    waiting_.erase(share.place_);
    return grant_waiting();  // those behind it
  }
  const auto held = by_caller_.find(share.caller_);
  KILN_CHECK(held != by_caller_.end() && held->second >= share.bytes_ && reserved_ >= share.bytes_);
  held->second -= share.bytes_;
  if (held->second == 0) by_caller_.erase(held);
  reserved_ -= share.bytes_;
  grant_waiting();
}

void ReceiveBudget::grant_waiting() {
  for (auto it = waiting_.begin(); it != waiting_.end();) {
    Share& next = **it++;
    if (!within_part(next)) continue;
    // Others wait behind it, so that a large message is not passed by for ever.
    if (reserved_ != 0 && reserved_ + next.bytes_ > total_) return;
    grant(next);
  }
}

ReceiveBudget::Share::~Share() {
  on_granted_ = nullptr;
  budget_->give_back(*this);
}

}  // namespace kiln
