// How far from fair the ledger divides a farm among users, in simulated time: workers of different speeds and
// thread counts, users who always have work, and some who have little.
//
// Fair is max-min: nobody gets less while somebody of the same weight gets more, unless he asks for less.
// What is measured is the time in which threads ran units, not the ledger's own account.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kiln::bench {

struct ShareCase {
  const char* name;
  uint32_t users = 50, jobs_each = 4, workers = 64;
  uint32_t thin_users = 0;     // of the users: they have two units at a time, less than their share
  uint32_t passing_users = 0;  // of the users: there in the middle third of the time only
  bool priorities = false;     // users' jobs have priority 0, 10 or 20: weights 1, 2, 4
  int64_t simulated_ms = 300000;
};

struct ShareFigures {
  double worst_error = 0;  // |got - fair| / fair; of users there in a third of the time, the worst third
  std::string worst_user;
  double units_per_second = 0;  // of the simulation, in our time
  uint64_t units = 0;
};

std::vector<ShareCase> share_cases();
ShareFigures measure_share(const ShareCase& c);

}  // namespace kiln::bench
