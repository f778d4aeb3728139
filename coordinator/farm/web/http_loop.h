// The connections of the pages, on one thread: it collects heads and sends answers, so that a peer which says
// or takes nothing holds neither a thread nor anybody else up.
#pragma once

#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <string>
#include <thread>
#include <vector>

#include "common/base/status.h"
#include "coordinator/farm/web/request_head.h"

namespace kiln {

struct HttpLimits {
  std::chrono::milliseconds patience{5000};  // for a request's head, and for its answer to be taken
  // Beyond these the oldest connection that waits for its peer gives way to the newest.
  size_t connections = 256, per_address = 64;
};

class HttpLoop {
 public:
  // Called on the loop's thread with every good head; must not wait. reply() answers it.
  using OnRequest = std::function<void(uint64_t connection, RequestHead head)>;

  // Listens at once, and answers from start() on. Port 0: any free one.
  static Expected<std::unique_ptr<HttpLoop>> open(const std::string& host, uint16_t port,
                                                  const HttpLimits& limits);
  ~HttpLoop();
  void start(OnRequest on_request);
  uint16_t port() const { return port_; }
  // From any thread, once for each request; forgotten if the peer has gone.
  void reply(uint64_t connection, std::string response);
  void stop();  // on_request is not called any more

 private:
  using Clock = std::chrono::steady_clock;
  enum class State { kReading, kAnswering, kWriting, kDraining };
  struct Peer {
    int fd = -1;
    std::string address;
    State state = State::kReading;
    Clock::time_point deadline;  // of its state
    HeadCollector head;
    std::string answer;
    size_t done = 0;  // of the answer, or drained
  };
  using Peers = std::map<uint64_t, Peer>;  // the oldest first

  HttpLoop(int listener, uint16_t port, int wake, const HttpLimits& limits);
  void run();
  void wait(std::vector<uint64_t>& ready, bool& callers);
  void take_replies();
  void end_late();
  void accept_callers();
  bool make_room(const std::string& address);
  bool drop_oldest(const std::string* address);
  void serve(Peers::iterator peer);
  void read(Peers::iterator peer);
  void answer(Peers::iterator peer, std::string response);
  void write(Peers::iterator peer);
  void drain(Peers::iterator peer);
  void close(Peers::iterator peer);

  const int listener_, wake_;
  const uint16_t port_;
  const HttpLimits limits_;
  OnRequest on_request_;
  Peers peers_;
  uint64_t last_ = 0;
  Clock::time_point accept_from_{};
  std::mutex mutex_;
  std::vector<std::pair<uint64_t, std::string>> replies_;
  std::atomic<bool> stop_{false};
  std::thread thread_;
};

// listening.cpp: a socket that listens there, and its port.
Expected<std::pair<int, uint16_t>> open_http_port(const std::string& host, uint16_t port);

}  // namespace kiln
