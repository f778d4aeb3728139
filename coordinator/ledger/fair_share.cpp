#include "coordinator/ledger/fair_share.h"

#include <algorithm>
#include <cmath>

namespace kiln {

double FairShare::weight(int32_t priority) {
  return std::exp2(std::clamp(priority, -100, 100) / 10.0);
}

void FairShare::wake(const std::string& name) {
  User& user = users_[name];
  if (user.awake) return;
  double least = -1;
  for (const auto& [other, state] : users_)
    if (state.awake && (least < 0 || state.virtual_time < least)) least = state.virtual_time;
  user.awake = true;
  if (least >= 0) user.virtual_time = std::max(user.virtual_time, least);
}

void FairShare::sleep(const std::string& name) {
  users_[name].awake = false;
}

void FairShare::charge(const std::string& name, double thread_ms, double weight) {
  User& user = users_[name];
  user.used_ms += thread_ms;
  user.virtual_time += thread_ms / weight;
}

double FairShare::virtual_time(const std::string& name) const {
  const auto it = users_.find(name);
  return it == users_.end() ? 0 : it->second.virtual_time;
}

double FairShare::used_ms(const std::string& name) const {
  const auto it = users_.find(name);
  return it == users_.end() ? 0 : it->second.used_ms;
}

}  // namespace kiln
