#include "tests/farm/raw_peer.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "common/base/check.h"

namespace kiln::test {
namespace {

sockaddr_in loopback(uint16_t port) {
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  return address;
}

bool readable(int fd, int patience_ms) {
  pollfd p{fd, POLLIN, 0};
  return ::poll(&p, 1, patience_ms) == 1;
}

}  // namespace

RawPeer::RawPeer(int fd) : fd_(fd) {}
RawPeer::~RawPeer() {
  close();
}

void RawPeer::close() {
  if (fd_ >= 0) ::close(fd_);
  fd_ = -1;
}

std::optional<RawPeer> RawPeer::try_connect(uint16_t port) {
  RawPeer peer(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0));
  const sockaddr_in address = loopback(port);
  if (::connect(peer.fd_, reinterpret_cast<const sockaddr*>(&address), sizeof address) != 0)
    return std::nullopt;
  return peer;
}

void RawPeer::shut_down() {
  ::shutdown(fd_, SHUT_RDWR);
}

RawPeer RawPeer::connect(uint16_t port) {
  auto peer = try_connect(port);
  KILN_CHECK(peer.has_value());
  return std::move(*peer);
}

void RawPeer::send_bytes(std::span<const std::byte> bytes) {
  while (!bytes.empty()) {
    const ssize_t put = ::send(fd_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    if (put <= 0) return;  // closed: the test sees it when it reads
    bytes = bytes.subspan(static_cast<size_t>(put));
  }
}

bool RawPeer::read_all(std::byte* to, size_t size, int patience_ms) {
  while (size > 0) {
    if (!readable(fd_, patience_ms)) return false;
    const ssize_t got = ::recv(fd_, to, size, 0);
    if (got <= 0) return false;
    to += got;
    size -= static_cast<size_t>(got);
  }
  return true;
}

std::optional<Bytes> RawPeer::receive_frame(int patience_ms) {
  Bytes frame(kFrameHeaderBytes);
  if (!read_all(frame.data(), frame.size(), patience_ms)) return std::nullopt;
  const auto header = read_frame_header(std::span(frame).first<kFrameHeaderBytes>());
  if (!header) return std::nullopt;
  frame.resize(kFrameHeaderBytes + header->length);
  if (!read_all(frame.data() + kFrameHeaderBytes, header->length, patience_ms)) return std::nullopt;
  return frame;
}

std::optional<Message> RawPeer::receive(int patience_ms) {
  const auto frame = receive_frame(patience_ms);
  if (!frame) return std::nullopt;
  const std::span<const std::byte> bytes(*frame);
  auto message =
      decode(*read_frame_header(bytes.first<kFrameHeaderBytes>()), bytes.subspan(kFrameHeaderBytes));
  if (!message) return std::nullopt;
  return std::move(*message);
}

bool RawPeer::closed(int patience_ms) {
  std::array<std::byte, 4096> dropped;
  for (;;) {
    if (!readable(fd_, patience_ms)) return false;
    if (::recv(fd_, dropped.data(), dropped.size(), 0) <= 0) return true;
  }
}

RawListener::RawListener() : fd_(::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
  sockaddr_in address = loopback(0);
  socklen_t size = sizeof address;
  KILN_CHECK(::bind(fd_, reinterpret_cast<const sockaddr*>(&address), size) == 0);
  KILN_CHECK(::listen(fd_, 16) == 0);
  KILN_CHECK(::getsockname(fd_, reinterpret_cast<sockaddr*>(&address), &size) == 0);
  port_ = ntohs(address.sin_port);
}
RawListener::~RawListener() {
  ::close(fd_);
}

std::optional<RawPeer> RawListener::accept(int patience_ms) {
  if (!readable(fd_, patience_ms)) return std::nullopt;
  const int fd = ::accept4(fd_, nullptr, nullptr, SOCK_CLOEXEC);
  if (fd < 0) return std::nullopt;
  return RawPeer(fd);
}

}  // namespace kiln::test
