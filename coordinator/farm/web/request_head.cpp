#include "coordinator/farm/web/request_head.h"

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

std::optional<tl::expected<RequestHead, HeadRefused>> HeadCollector::add(std::string_view bytes) {
  const size_t from = head_.size() < 3 ? 0 : head_.size() - 3;
  head_.append(bytes.substr(0, kMaxHeadBytes + 4 - std::min(head_.size(), kMaxHeadBytes + 4)));
  const size_t end = head_.find("\r\n\r\n", from);
  if (std::min(end, head_.size()) > kMaxHeadBytes) return refuse(431, "the head is larger than 8 KiB");
  if (end == head_.npos) return std::nullopt;
  return parse_request_head(std::string_view(head_).substr(0, end + 4));
}

}  // namespace kiln
