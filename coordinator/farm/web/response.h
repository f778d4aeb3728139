// What a page answers, as the bytes of HTTP/1.1. One answer a connection.
#pragma once

#include <string>

namespace kiln {

struct Response {
  int status = 200;
  std::string type = "text/plain; charset=utf-8", content{};
  std::string headers{};  // more of them, each with its end of line
};

Response plain_response(int status, const std::string& words);
std::string write_response(const Response& response);

}  // namespace kiln
