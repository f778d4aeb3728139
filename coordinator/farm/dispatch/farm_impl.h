// The farm's thread and its state. Internal to coordinator/farm/dispatch.
#pragma once

#include <condition_variable>
#include <mutex>
#include <optional>
#include <thread>

#include "common/base/clock.h"
#include "coordinator/farm/dispatch/farm.h"
#include "coordinator/farm/dispatch/local_workers.h"
#include "coordinator/farm/dispatch/server.h"

namespace kiln {

class FarmImpl final : public Farm {
 public:
  FarmImpl(const FarmSettings& settings, std::shared_ptr<ResultStore> store);
  ~FarmImpl() override;
  Status open();

  Expected<std::unique_ptr<FarmJob>> open_job(const FarmJobSpec& job) override;
  void change_job(JobId job, int32_t priority, bool paused) override;
  void stop_job(JobId job, const Error& why) override;
  void hold(bool on, const std::string& reason) override;
  void restore_trust(const std::string& identity, uint64_t agreed,
                     const std::string& quarantined_for) override;
  FarmStatus status() override;
  std::vector<std::string> why_job(JobId job) override;
  std::vector<std::string> why_unit(JobId job, uint64_t unit) override;
  std::vector<std::string> why_worker(const std::string& number_or_name) override;
  uint16_t port() const override { return port_; }
  void post(std::function<void()> work) override { loop_.post(std::move(work)); }

  // Runs the work on the farm's thread and waits for it.
  void run(const std::function<void(Server&)>& work);
  ResultStore& store() { return *store_; }

 private:
  Status open_on_loop();
  void close_on_loop();
  void tick();

  FarmSettings settings_;
  std::shared_ptr<ResultStore> store_;
  EventLoop loop_;
  const std::unique_ptr<Timing> timing_ = loop_timing(loop_);
  std::optional<Timer> timer_;
  std::optional<Server> server_;
  std::optional<LocalWorkers> local_;
  SteadyClock clock_;
  uint16_t port_ = 0;
  bool stop_ = false;    // of the loop's thread
  std::jthread thread_;  // last: ends first
};

}  // namespace kiln
