#include "common/base/printable.h"

#include <algorithm>
#include <utility>

#include "common/base/format.h"

namespace kiln {
namespace {

// The code point at the front and the number of its bytes; 0 bytes: no UTF-8 (RFC 3629).
std::pair<char32_t, size_t> first_code_point(std::string_view text) {
  const auto at = [&](size_t i) { return static_cast<unsigned char>(text[i]); };
  const unsigned char lead = at(0);
  const size_t size = lead < 0x80 ? 1 : lead >> 5 == 6 ? 2 : lead >> 4 == 14 ? 3 : lead >> 3 == 30 ? 4 : 0;
  if (size == 0 || size > text.size()) return {0, 0};
  char32_t code = size == 1 ? lead : lead & (0x7f >> size);
  for (size_t i = 1; i < size; ++i) {
    if (at(i) >> 6 != 2) return {0, 0};
    code = code << 6 | (at(i) & 0x3f);
  }
  constexpr char32_t kLeast[] = {0, 0, 0x80, 0x800, 0x10000};
  const bool surrogate = code >= 0xd800 && code < 0xe000;
  return code < kLeast[size] || code > 0x10ffff || surrogate ? std::pair<char32_t, size_t>{0, 0}
                                                             : std::pair{code, size};
}

bool is_printable(char32_t c) {
  const bool control = c < 0x20 || (c >= 0x7f && c < 0xa0);
  const bool line = c == 0x2028 || c == 0x2029;
  const bool order = c == 0x061c || c == 0x200e || c == 0x200f || (c >= 0x202a && c <= 0x202e) ||
                     (c >= 0x2066 && c <= 0x2069);
  return !control && !line && !order;
}

}  // namespace

std::string printable(std::string_view text) {
  std::string out;
  out.reserve(text.size());
  while (!text.empty()) {
    const auto [code, size] = first_code_point(text);
    if (size > 0 && is_printable(code))
      out += text.substr(0, size);
    else if (code == '\n' || code == '\t' || code == '\r')
      out += code == '\n' ? "\\n" : code == '\t' ? "\\t" : "\\r";
    else if (size > 1)
      out += kiln::text("\\u{{{:x}}}", static_cast<uint32_t>(code));
    else
      out += kiln::text("\\x{:02x}", static_cast<unsigned>(static_cast<unsigned char>(text[0])));
    text.remove_prefix(std::max<size_t>(1, size));
  }
  return out;
}

}  // namespace kiln
