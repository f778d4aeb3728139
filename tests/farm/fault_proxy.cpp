#include "tests/farm/fault_proxy.h"

#include <thread>

#include "tests/farm/raw_peer.h"

namespace kiln::test {
namespace {

constexpr int kForever = -1;

FrameHeader header_of(const Bytes& frame) {
  return *read_frame_header(std::span(frame).first<kFrameHeaderBytes>());
}

void to_coordinator(RawPeer& worker, RawPeer& coordinator, const WireFaults& faults) {
  for (uint32_t n = 1; auto frame = worker.receive_frame(kForever); ++n) {
    const bool result = header_of(*frame).type == Result::kKind.type;
    if (faults.version) (*frame)[2] = std::byte(faults.version);
    if (faults.flip_every && n % faults.flip_every == 0)
      (*frame)[kFrameHeaderBytes + n % (frame->size() - kFrameHeaderBytes)] ^= std::byte{16};
    for (uint32_t copy = 0; copy < (result ? faults.copies : 1); ++copy) coordinator.send_bytes(*frame);
  }
  coordinator.shut_down();
}

void to_worker(RawPeer& coordinator, RawPeer& worker, const WireFaults& faults) {
  while (const auto frame = coordinator.receive_frame(kForever)) {
    const MessageType type = header_of(*frame).type;
    if (faults.drop_withdraw && type == Withdraw::kKind.type) continue;
    if (faults.drop_acks && type == CommitAck::kKind.type) continue;
    worker.send_bytes(*frame);
  }
  worker.shut_down();
}

}  // namespace

uint16_t start_fault_proxy(uint16_t port, const WireFaults& faults) {
  static RawListener listener;
  std::thread([port, faults] {
    for (;;) {
      auto worker = listener.accept(kForever);
      auto coordinator = RawPeer::try_connect(port);
      if (!worker || !coordinator) continue;  // the worker sees its connection closed
      std::thread down([&] { to_worker(*coordinator, *worker, faults); });
      to_coordinator(*worker, *coordinator, faults);
      down.join();
    }
  }).detach();
  return listener.port();
}

}  // namespace kiln::test
