#include "coordinator/farm/web/request_head.h"

#include <poll.h>
#include <sys/socket.h>

#include <algorithm>

namespace kiln {
namespace {

tl::unexpected<HeadRefused> refuse(int status, std::string why) {
  return tl::unexpected<HeadRefused>(HeadRefused{status, std::move(why)});
}

bool is_path(std::string_view path) {
  const auto good = [](unsigned char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '.' || c == '_' || c == '/';
  };
  return !path.empty() && path[0] == '/' && std::all_of(path.begin(), path.end(), good) &&
         path.find("..") == path.npos;
}

// RFC 9110, section 5.6.2.
bool is_token(std::string_view name) {
  const auto good = [](unsigned char c) {
    return c > 32 && c < 127 &&
           std::string_view("\"(),/:;<=>?@[\\]{}").find(static_cast<char>(c)) == std::string_view::npos;
  };
  return !name.empty() && std::all_of(name.begin(), name.end(), good);
}

std::string lower(std::string_view text) {
  std::string low(text);
  for (char& c : low)
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c + 32);
  return low;
}

std::string_view trimmed(std::string_view text) {
  while (!text.empty() && (text.front() == ' ' || text.front() == '\t')) text.remove_prefix(1);
  while (!text.empty() && (text.back() == ' ' || text.back() == '\t')) text.remove_suffix(1);
  return text;
}

tl::expected<void, HeadRefused> read_field(std::string_view line, RequestHead& head) {
  const size_t colon = line.find(':');
  if (colon == line.npos || !is_token(line.substr(0, colon)))
    return refuse(400, "a header is not NAME: VALUE");
  const std::string name = lower(line.substr(0, colon));
  const std::string_view value = trimmed(line.substr(colon + 1));
  if (std::any_of(value.begin(), value.end(),
                  [](unsigned char c) { return (c < 32 && c != '\t') || c == 127; }))
    return refuse(400, "a header holds control characters");
  if (name == "content-length" && value != "0") return refuse(413, "nothing is taken here: send no content");
  if (name == "transfer-encoding") return refuse(413, "nothing is taken here: send no content");
  std::string* kept = name == "host" ? &head.host : name == "authorization" ? &head.authorization : nullptr;
  if (!kept) return {};
  if (!kept->empty()) return refuse(400, "a header came twice");
  *kept = value;
  return {};
}

}  // namespace

tl::expected<RequestHead, HeadRefused> parse_request_head(std::string_view text) {
  RequestHead head;
  size_t at = text.find("\r\n");
  const std::string_view first = text.substr(0, std::min(at, text.size()));
  const size_t method = first.find(' ');
  const size_t target = method == first.npos ? first.npos : first.find(' ', method + 1);
  if (at == text.npos || target == first.npos)
    return refuse(400, "the first line is not METHOD PATH VERSION");
  const std::string_view version = first.substr(target + 1);
  if (version != "HTTP/1.1" && version != "HTTP/1.0") return refuse(505, "HTTP/1.1 is spoken here");
  if (first.substr(0, method) != "GET") return refuse(405, "this can be read only: GET");
  const std::string_view path = first.substr(method + 1, target - method - 1);
  head.path = path.substr(0, std::min(path.find('?'), path.size()));
  if (!is_path(head.path)) return refuse(400, "no such path can be here");
  for (at += 2; at < text.size();) {
    const size_t end = text.find("\r\n", at);
    if (end == text.npos) return refuse(400, "a line of the head does not end");
    if (end == at) return head;
    if (auto good = read_field(text.substr(at, end - at), head); !good)
      return tl::unexpected<HeadRefused>(good.error());
    at = end + 2;
  }
  return refuse(400, "the head does not end");
}

tl::expected<RequestHead, HeadRefused> read_request_head(int socket, std::chrono::milliseconds patience) {
  const auto limit = std::chrono::steady_clock::now() + patience;
  std::string head;
  char buffer[2048];
  for (;;) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(limit - std::chrono::steady_clock::now());
    pollfd ready{socket, POLLIN, 0};
    if (left.count() <= 0 || ::poll(&ready, 1, static_cast<int>(left.count())) == 0)
      return refuse(408, "the request took too long");
    const ssize_t got = ::recv(socket, buffer, sizeof buffer, 0);
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) return refuse(0, "");
    const size_t from = head.size() < 3 ? 0 : head.size() - 3;
    head.append(buffer, static_cast<size_t>(got));
    const size_t end = head.find("\r\n\r\n", from);
    if (std::min(end, head.size()) > kMaxHeadBytes) return refuse(431, "the head is larger than 8 KiB");
    if (end != head.npos) return parse_request_head(std::string_view(head).substr(0, end + 4));
  }
}

}  // namespace kiln
