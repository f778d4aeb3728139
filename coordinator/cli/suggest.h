// What somebody who mistyped a word may have meant.
#pragma once

#include <string>
#include <vector>

namespace kiln {

// The candidate that is the fewest typing mistakes away from `word` (insertions, omissions, replacements, and
// neighbours exchanged: Damerau's four), the first of several; empty if none is within a third of its length.
std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates);

}  // namespace kiln
