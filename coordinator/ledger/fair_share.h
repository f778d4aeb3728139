// Whose turn it is: weighted fair queueing of users over thread time. A user's virtual time runs forward by
// thread time used / weight; the runnable user whose virtual time is least is served next.
#pragma once

#include <map>
#include <string>

#include "coordinator/ledger/rules.h"

namespace kiln {

class FairShare {
 public:
  // 2 ^ (priority / 10).
  static double weight(int32_t priority);

  // The user has runnable work from now on, after having had none: what it did not use meanwhile is not saved
  // up.
  void wake(const std::string& user);
  void sleep(const std::string& user);
  void charge(const std::string& user, double thread_ms, double weight);
  double virtual_time(const std::string& user) const;
  double used_ms(const std::string& user) const;  // thread time, for `why` and tests

 private:
  struct User {
    double virtual_time = 0, used_ms = 0;
    bool awake = false;
  };
  std::map<std::string, User> users_;
};

}  // namespace kiln
