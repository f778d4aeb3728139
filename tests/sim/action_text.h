// One line for each action, with all its fields: for traces, and for digests of a world's whole conduct.
#pragma once

#include <string>

#include "coordinator/farm/ledger/actions.h"

namespace kiln::sim {

std::string action_text(const Action& action);

}  // namespace kiln::sim
