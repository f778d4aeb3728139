#include "coordinator/farm/web/answer_pool.h"

namespace kiln {

AnswerPool::AnswerPool(uint32_t threads, uint32_t waiting) : most_(waiting) {
  for (uint32_t i = 0; i < threads; ++i) threads_.emplace_back([this] { run(); });
}

AnswerPool::~AnswerPool() {
  {
    const std::lock_guard lock(mutex_);
    stop_ = true;
  }
  changed_.notify_all();
  for (std::thread& thread : threads_) thread.join();
}

bool AnswerPool::give(std::function<void()> work) {
  {
    const std::lock_guard lock(mutex_);
    if (work_.size() >= most_) return false;
    work_.push_back(std::move(work));
  }
  changed_.notify_one();
  return true;
}

void AnswerPool::run() {
  for (;;) {
    std::function<void()> work;
    {
      std::unique_lock lock(mutex_);
      changed_.wait(lock, [this] { return stop_ || !work_.empty(); });
      if (stop_) return;
      work = std::move(work_.front());
      work_.pop_front();
    }
    work();
  }
}

}  // namespace kiln
