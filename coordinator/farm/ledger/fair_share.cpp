#include "coordinator/farm/ledger/fair_share.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"

namespace kiln {

double FairShare::weight(int32_t priority) {
  return std::exp2(std::clamp(priority, -100, 100) / 10.0);
}

UserId FairShare::intern(const std::string& name) {
  const auto [it, added] = by_name_.emplace(name, static_cast<UserId>(users_.size()));
  if (added) users_.emplace_back().name = name;
  return it->second;
}

void FairShare::wake(UserId id) {
  User& user = users_[id];
  if (user.awake) return;
  double least = -1;
  for (const User& other : users_)
    if (other.awake && (least < 0 || other.virtual_time < least)) least = other.virtual_time;
  user.awake = true;
  if (least >= 0) user.virtual_time = std::max(user.virtual_time, least);
}

void FairShare::charge(UserId id, double thread_ms, double weight) {
  KILN_CHECK(id < users_.size() && weight > 0 && thread_ms >= 0);
  User& user = users_[id];
  user.used_ms += thread_ms;
  user.virtual_time += thread_ms / weight;
}

double FairShare::used_ms(const std::string& name) const {
  const auto it = by_name_.find(name);
  return it == by_name_.end() ? 0 : users_[it->second].used_ms;
}

}  // namespace kiln
