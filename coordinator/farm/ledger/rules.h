// Parameters of scheduling and verification.
#pragma once

#include <cstdint>
#include <string>

#include "common/base/hash.h"

namespace kiln {

using JobId = uint64_t;     // from 1, never reused
using WorkerId = uint32_t;  // one process of a worker; drawn by the coordinator, new after its restart

constexpr uint32_t kMaxWorkerThreads = 4096;

struct FarmRules {
  int64_t lease_ms = 15000;   // silence after which a worker's units go to others
  int64_t hang_ms = 600000;   // a heartbeating worker that holds a unit this long has hung
  uint32_t max_attempts = 3;  // distinct workers that a unit may cost before it has failed
  int64_t class_patience_ms =
      600000;  // a job that no worker of its numeric class can continue changes class after this
  int64_t residence_ms = 2000;      // a worker stays with a job at least this long: scenes are costly to load
  double speculative_share = 0.05;  // share of a pass's work that may be done twice to finish it sooner
  // The dose of verification (BOINC's adaptive replication: Anderson, "BOINC: A Platform for Volunteer
  // Computing", 2019, section 3.4): all units of a worker until `audit_first` of its answers agreed with
  // another's, then each with probability max(audit_least, 1 / agreed). 0: machines are trusted.
  uint32_t audit_first = 0;
  double audit_least = 0.01;
  uint64_t audit_seed = 0;  // secret: a worker must not be able to tell which unit is verified
  // Whether workers' owners are told apart (by certificates, or by tokens of their own). Otherwise votes are
  // machines', which finds a broken machine but not an owner who lies with several.
  bool owners_known = false;
};

// What happens to a job when a unit failed on every worker that tried it. Stored.
enum class PoisonPolicy : uint8_t { kFail = 0, kSkip = 1 };

struct JobTraits {
  std::string user, name;
  int32_t priority =
      0;  // -100 to 100; ten more points double a user's share; also orders the user's own jobs
  bool paused = false;
  uint32_t quorum = 1;  // different workers whose answers to every unit must be equal
  PoisonPolicy poison = PoisonPolicy::kFail;
  std::string numeric_class;  // of existing results; empty: that of the first worker
};

struct WorkerTraits {
  std::string identity;  // the subject of trust: a certificate's name, or the process
  std::string name;      // for people
  uint32_t threads = 1;
  uint64_t process =
      0;  // random number drawn at start: a worker that returns with the same number did not crash
  // Who answers for it: the name in its certificate, or the holder of a worker token of their own. Empty:
  // nobody in particular, as with the token that all workers share.
  std::string owner{};
  // Whose vote its answers are: equal answers of one voter count once. The owner where owners are known, else
  // the machine. Empty: its identity.
  std::string voter{};
};

// One unit of a pass, in order of value.
struct UnitPlan {
  uint64_t id = 0;     // unique in the job
  uint64_t shape = 0;  // of its texels and samples: a result with another shape belongs to another unit
  double weight = 1;   // work: texels x samples
};

// An answer on disk, as restored by a restarted coordinator.
struct KnownAnswer {
  uint64_t unit = 0, shape = 0;
  Digest digest;
  std::string identity;   // the worker that gave it
  bool settled = false;   // it is the unit's result
  bool verified = false;  // another voter gave the same
  // Whether the identity is its own voter (WorkerTraits::voter). If not, whose vote this is stays unknown
  // until the worker is back; until then it counts as nobody's but the first's.
  bool own_voter = true;
};

}  // namespace kiln
