// text("{} texels", n): the one way to make messages. fmt is included here only.
#pragma once

#include <fmt/format.h>

#include <string>

namespace kiln {
template <class... Args>
std::string text(fmt::format_string<Args...> format, Args&&... args) {
  return fmt::format(format, std::forward<Args>(args)...);
}
}  // namespace kiln
