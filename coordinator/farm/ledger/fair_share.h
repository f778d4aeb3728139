// Weighted fair queueing of users over thread time. A user's virtual time advances by thread time used /
// weight; the runnable user with the smallest virtual time is served next.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "coordinator/farm/ledger/rules.h"

namespace kiln {

using UserId = uint32_t;  // in order of first appearance

class FairShare {
 public:
  // 2 ^ (priority / 10).
  static double weight(int32_t priority);

  UserId intern(const std::string& name);
  size_t size() const { return users_.size(); }
  // The user becomes runnable after having been idle: unused time is not saved up.
  void wake(UserId user);
  void sleep(UserId user) { users_[user].awake = false; }
  void charge(UserId user, double thread_ms, double weight);
  double virtual_time(UserId user) const { return users_[user].virtual_time; }
  double used_ms(UserId user) const { return users_[user].used_ms; }  // thread time, for `why` and tests
  double used_ms(const std::string& name) const;                      // 0: unknown
  // Threads that serve the user now, or are switching to it.
  void add_threads(UserId user, double threads) { users_[user].threads += threads; }
  double threads(UserId user) const { return users_[user].threads; }
  const std::string& name(UserId user) const { return users_[user].name; }

 private:
  struct User {
    std::string name;
    double virtual_time = 0, used_ms = 0, threads = 0;
    bool awake = false;
  };
  std::vector<User> users_;
  std::map<std::string, UserId> by_name_;
};

}  // namespace kiln
