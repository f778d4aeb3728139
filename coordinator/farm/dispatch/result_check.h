// Sanity checks on a result before its numbers are used.
#pragma once

#include "common/wire/messages.h"

namespace kiln {

// `unit`: null if it is of an earlier pass and no longer known. Errors say what is wrong. Finds what cannot
// be: numbers that are not finite, counts outside of the samples, luminances and visibilities below zero; that they are the
// right ones only a second worker can say.
Status check_result(const Result& result, const WorkUnit* unit, const MomentLayout& layout);

}  // namespace kiln
