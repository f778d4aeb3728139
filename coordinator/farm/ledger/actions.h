// Actions that the ledger requests, to be carried out in order.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "common/base/status.h"
#include "coordinator/farm/ledger/rules.h"

namespace kiln {

struct Assign {  // send the job; the worker replies with its class and credits, or that it cannot bake it
  WorkerId worker;
  JobId job;
};
struct Release {  // the worker may forget the job
  WorkerId worker;
  JobId job;
  std::string reason;
};
struct Grant {
  WorkerId worker;
  JobId job;
  uint64_t lease, unit;
};
struct Recall {  // tell the worker not to start the unit
  WorkerId worker;
  JobId job;
  uint64_t unit;
};
struct StoreAnswer {  // make the answer just received durable, then call stored()
  WorkerId worker;
  std::string identity;
  JobId job;
  uint64_t unit, shape;
  Digest digest;
  uint64_t ticket;  // argument of stored()
};
struct Settle {  // this answer is the unit's result: durable, and agreed on as required
  JobId job;
  uint64_t unit;
  Digest digest;
  bool verified;
  std::string identity;  // the identity that vouches for it: the first voter may have been quarantined since
};
struct Deliver {  // to the merge; once per unit and pass
  JobId job;
  uint64_t unit;
  Digest digest;
};
struct Revoke {  // delete these answers from disk: their worker gave wrong ones
  JobId job;
  uint64_t unit;
  Digest digest;
};
struct Rewind {  // delivered results are revoked: merge again from the first pass
  JobId job;
  std::string reason;
};
struct PinClass {  // accept results of this numeric class only
  JobId job;
  std::string numeric_class;
};
struct Acknowledge {  // the worker may forget its result
  WorkerId worker;
  JobId job;
  uint64_t unit;
  Digest digest;
};
struct Trust {  // store how often the worker's answers agreed with another's
  std::string identity;
  uint64_t agreed;
};
struct Quarantine {  // store the quarantine, and refuse the worker from now on
  std::string identity, reason;
};
struct Expel {  // tell the worker why and close its connection; then call leave()
  WorkerId worker;
  std::string reason;
};
struct SkipUnit {  // it failed permanently and the job continues without it
  JobId job;
  uint64_t unit;
  std::string reason;
};
struct FailJob {
  JobId job;
  Error error;
};
struct PassComplete {
  JobId job;
};
struct Note {  // for the report and the log; job 0: about the farm
  JobId job;
  std::string text;
};

using Action =
    std::variant<Assign, Release, Grant, Recall, StoreAnswer, Settle, Deliver, Revoke, Rewind, PinClass,
                 Acknowledge, Trust, Quarantine, Expel, SkipUnit, FailJob, PassComplete, Note>;
using Actions = std::vector<Action>;

}  // namespace kiln
