// Lets the threads of a task hold only so much memory at a time. Who asks for more waits; nobody is refused,
// so results do not depend on it.
#pragma once

#include <condition_variable>
#include <cstdint>
#include <mutex>

namespace kiln {

class MemoryGate {
 public:
  explicit MemoryGate(uint64_t bytes) : bytes_(bytes) {}

  // A thread's share, given back at its end. One `take` for each: two could wait for each other.
  class Hold {
   public:
    explicit Hold(MemoryGate& gate) : gate_(gate) {}
    ~Hold() { gate_.give(held_); }
    Hold(const Hold&) = delete;
    Hold& operator=(const Hold&) = delete;
    // Waits for room; what is larger than the gate goes through alone.
    void take(uint64_t bytes) {
      std::unique_lock lock(gate_.mutex_);
      gate_.freed_.wait(lock, [&] { return gate_.held_ == 0 || gate_.held_ + bytes <= gate_.bytes_; });
      gate_.held_ += bytes;
      held_ += bytes;
    }

   private:
    MemoryGate& gate_;
    uint64_t held_ = 0;
  };

 private:
  void give(uint64_t bytes) {
    {
      const std::lock_guard lock(mutex_);
      held_ -= bytes;
    }
    freed_.notify_all();
  }

  const uint64_t bytes_;
  uint64_t held_ = 0;
  std::mutex mutex_;
  std::condition_variable freed_;
};

}  // namespace kiln
