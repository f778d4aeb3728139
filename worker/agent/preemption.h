// Notices that this machine will be taken away: a file that an operator or a service makes, or the metadata
// address of a cloud.
#pragma once

#include <chrono>
#include <condition_variable>
#include <functional>
#include <mutex>
#include <string>
#include <thread>

namespace kiln {

// Whose metadata service is asked. The links are to the pages that define the answers.
//   kAws    https://docs.aws.amazon.com/AWSEC2/latest/UserGuide/spot-instance-termination-notices.html
//   kGcp    https://cloud.google.com/compute/docs/instances/spot
//   kAzure  https://learn.microsoft.com/azure/virtual-machines/linux/scheduled-events
enum class Cloud { kNone, kAws, kGcp, kAzure };

struct PreemptionSettings {
  std::string file;  // a notice once it exists; empty: none
  Cloud cloud = Cloud::kNone;
  std::string address = "169.254.169.254";  // of the metadata service, the same in all three clouds
  int port = 80;
  std::chrono::milliseconds every{2000};  // the shortest notice of the three is 30 s
  bool asks() const { return !file.empty() || cloud != Cloud::kNone; }
};

// Asks once. Returns why the machine will go, or nothing. A service that does not answer is no notice.
std::string preemption_notice(const PreemptionSettings& settings);

// Asks every now and then on a thread of its own, and calls `on_notice` once, on that thread.
class PreemptionWatch {
 public:
  PreemptionWatch(const PreemptionSettings& settings, std::function<void(const std::string&)> on_notice);
  ~PreemptionWatch();

 private:
  void watch();

  const PreemptionSettings settings_;
  const std::function<void(const std::string&)> on_notice_;
  std::mutex mutex_;
  std::condition_variable ended_;
  bool end_ = false;
  std::thread thread_;
};

}  // namespace kiln
