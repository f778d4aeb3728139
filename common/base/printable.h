// Texts that came from outside, for a terminal or a log.
#pragma once

#include <string>
#include <string_view>

namespace kiln {

// One line of printable UTF-8: control characters (C0, DEL, C1), the marks that end a line or turn the order
// of writing, and bytes that are no UTF-8 become \n, \t, \r, \xNN or \u{NNNN}. Everything else stays.
std::string printable(std::string_view text);

}  // namespace kiln
