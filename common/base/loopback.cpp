#include "common/base/loopback.h"

#include <arpa/inet.h>

#include <charconv>
#include <cstring>
#include <string>

namespace kiln {
namespace {

bool is_loopback_v6(std::string_view host) {
  in6_addr address{};
  return host.find('\0') == host.npos && ::inet_pton(AF_INET6, std::string(host).c_str(), &address) == 1 &&
         std::memcmp(&address, &in6addr_loopback, sizeof address) == 0;
}

bool is_loopback_v4(std::string_view host) {
  in_addr address{};
  return host.find('\0') == host.npos && ::inet_pton(AF_INET, std::string(host).c_str(), &address) == 1 &&
         (ntohl(address.s_addr) >> 24) == 127;
}

bool is_port(std::string_view text) {
  uint16_t port = 0;
  const auto [stop, code] = std::from_chars(text.data(), text.data() + text.size(), port);
  return code == std::errc() && stop == text.data() + text.size();
}

}  // namespace

bool is_loopback(std::string_view host) {
  return host == "localhost" || is_loopback_v4(host) || is_loopback_v6(host);
}

bool is_loopback_authority(std::string_view authority) {
  const bool bracketed = authority.starts_with('[');
  const size_t end = bracketed ? authority.find(']') : authority.find(':');
  if (bracketed && end == authority.npos) return false;
  const std::string_view host = bracketed ? authority.substr(1, end - 1) : authority.substr(0, end);
  const std::string_view rest =
      end == authority.npos ? std::string_view() : authority.substr(bracketed ? end + 1 : end);
  if (!rest.empty() && !(rest[0] == ':' && is_port(rest.substr(1)))) return false;
  return bracketed ? is_loopback_v6(host) : host == "localhost" || is_loopback_v4(host);
}

}  // namespace kiln
