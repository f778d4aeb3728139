// Collects the head of an HTTP request from pieces, of limited size, and checks it against the small part of
// HTTP/1.1 (RFC 9112) that these pages need.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "common/base/status.h"

namespace kiln {

inline constexpr size_t kMaxHeadBytes = 8192;

struct RequestHead {
  std::string path;           // letters, digits and -._/ ; what follows a '?' is dropped
  std::string host;           // as sent; empty: none
  std::string authorization;  // as sent
};

struct HeadRefused {
  int status;  // of HTTP
  std::string why;
};

tl::expected<RequestHead, HeadRefused> parse_request_head(std::string_view head);

class HeadCollector {
 public:
  // The head, or why it is refused, once these bytes decide it. Not to be called again after that.
  std::optional<tl::expected<RequestHead, HeadRefused>> add(std::string_view bytes);

 private:
  std::string head_;
};

}  // namespace kiln
