// Reads the head of an HTTP request from a socket, with limits on size and time, and checks it against the
// small part of HTTP/1.1 (RFC 9112) that these pages need.
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
  int status;  // HTTP status; 0: the peer is gone
  std::string why;
};

tl::expected<RequestHead, HeadRefused> parse_request_head(std::string_view head);
tl::expected<RequestHead, HeadRefused> read_request_head(int socket, std::chrono::milliseconds patience);

}  // namespace kiln
