#include "coordinator/farm/web/response.h"

#include "common/base/format.h"

namespace kiln {
namespace {

const char* phrase(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 401:
      return "Unauthorized";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 408:
      return "Request Timeout";
    case 413:
      return "Content Too Large";
    case 421:
      return "Misdirected Request";
    case 431:
      return "Request Header Fields Too Large";
    case 500:
      return "Internal Server Error";
    case 503:
      return "Service Unavailable";
    case 505:
      return "HTTP Version Not Supported";
    default:
      return "Bad Request";
  }
}

}  // namespace

Response plain_response(int status, const std::string& words) {
  Response response;
  response.status = status;
  response.content = words + "\n";
  if (status == 405) response.headers = "Allow: GET\r\n";
  return response;
}

std::string write_response(const Response& r) {
  return text(
      "HTTP/1.1 {} {}\r\nContent-Type: {}\r\nContent-Length: {}\r\nCache-Control: no-store\r\n"
      "X-Content-Type-Options: nosniff\r\nReferrer-Policy: no-referrer\r\n{}Connection: close\r\n\r\n{}",
      r.status, phrase(r.status), r.type, r.content.size(), r.headers, r.content);
}

}  // namespace kiln
