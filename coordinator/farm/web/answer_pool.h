// Threads that make the answers: a fixed number, and a bounded number of requests that wait for one.
#pragma once

#include <condition_variable>
#include <deque>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace kiln {

class AnswerPool {
 public:
  AnswerPool(uint32_t threads, uint32_t waiting);
  ~AnswerPool();                          // work that has not begun is dropped
  bool give(std::function<void()> work);  // false: too many wait

 private:
  void run();
  const uint32_t most_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::deque<std::function<void()>> work_;
  bool stop_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace kiln
