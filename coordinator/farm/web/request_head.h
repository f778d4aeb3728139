// The head of an HTTP request, read from a socket with a bound on its size and on the time it may take, and
// checked against the little of HTTP/1.1 (RFC 9112) that a reader of these pages needs.
#pragma once

#include <chrono>
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
  int status;  // of HTTP; 0: the peer is gone, nobody to tell
  std::string why;
};

tl::expected<RequestHead, HeadRefused> parse_request_head(std::string_view head);
tl::expected<RequestHead, HeadRefused> read_request_head(int socket, std::chrono::milliseconds patience);

}  // namespace kiln
