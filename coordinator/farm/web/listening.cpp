#include <netdb.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <memory>

#include "common/base/format.h"
#include "coordinator/farm/web/http_loop.h"

namespace kiln {
namespace {

int listen_at(const addrinfo& at) {
  const int fd = ::socket(at.ai_family, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return -1;
  // Not SO_REUSEPORT: a second server on the port is an error.
  const int on = 1;
  ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  if (::bind(fd, at.ai_addr, at.ai_addrlen) == 0 && ::listen(fd, SOMAXCONN) == 0) return fd;
  const int code = errno;
  ::close(fd);
  errno = code;
  return -1;
}

}  // namespace

Expected<std::pair<int, uint16_t>> open_http_port(const std::string& host, uint16_t port) {
  const auto cannot = [&](const char* why) {
    return fail(ErrorKind::kIo,
                text("cannot serve HTTP on {}:{}: {}; another program has the port, or the name is not this "
                     "machine's: choose another, or 0 for any free one",
                     host, port, why));
  };
  addrinfo hints{}, *first = nullptr;
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  if (const int code = ::getaddrinfo(host.c_str(), std::to_string(port).c_str(), &hints, &first); code != 0)
    return cannot(::gai_strerror(code));
  const std::unique_ptr<addrinfo, decltype(&::freeaddrinfo)> found(first, &::freeaddrinfo);
  int fd = -1;
  for (const addrinfo* at = found.get(); at && fd < 0; at = at->ai_next) fd = listen_at(*at);
  if (fd < 0) return cannot(std::strerror(errno));
  sockaddr_storage own{};
  socklen_t size = sizeof own;
  ::getsockname(fd, reinterpret_cast<sockaddr*>(&own), &size);
  const in_port_t bound = own.ss_family == AF_INET6 ? reinterpret_cast<const sockaddr_in6&>(own).sin6_port
                                                    : reinterpret_cast<const sockaddr_in&>(own).sin_port;
  return std::pair(fd, ntohs(bound));
}

}  // namespace kiln
