// Memory for large messages that are arriving, shared by all connections of a listener. A message reserves
// its whole announced size here before more than its first kUnreservedBytes are read; only bytes that arrived
// are ever allocated. Reserving at once, not piece by piece, rules out two messages waiting for each other.
#pragma once

#include <cstddef>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <string>

namespace kiln {

class ReceiveBudget {
 public:
  // A reservation, or a place in the queue for one. Destroying it gives either back.
  class Share {
   public:
    ~Share();
    Share(const Share&) = delete;
    Share& operator=(const Share&) = delete;

   private:
    friend class ReceiveBudget;
    Share(std::shared_ptr<ReceiveBudget> budget, std::string caller, size_t bytes)
        : budget_(std::move(budget)), caller_(std::move(caller)), bytes_(bytes) {}
    std::shared_ptr<ReceiveBudget> budget_;
    const std::string caller_;
    const size_t bytes_;
    bool granted_ = false;
    std::function<void()> on_granted_;
    std::list<Share*>::iterator place_;
  };

  // `per_caller` of `total` is the most that one caller may hold; a message larger than that may come alone.
  static std::shared_ptr<ReceiveBudget> make(size_t total, size_t per_caller);

  // Calls `on_granted` once, now or when others have given back enough; first come, first served, except that
  // a caller over its part does not keep others waiting. Loop thread only.
  static std::unique_ptr<Share> reserve(const std::shared_ptr<ReceiveBudget>& budget,
                                        const std::string& caller, size_t bytes,
                                        std::function<void()> on_granted);
  size_t reserved() const { return reserved_; }

 private:
  ReceiveBudget(size_t total, size_t per_caller) : total_(total), per_caller_(per_caller) {}
  bool within_part(const Share& share) const;
  void grant(Share& share);
  void grant_waiting();
  void give_back(Share& share);

  const size_t total_, per_caller_;
  size_t reserved_ = 0;
  std::map<std::string, size_t> by_caller_;
  std::list<Share*> waiting_;  // the first come first
};

}  // namespace kiln
