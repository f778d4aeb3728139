// Internal to coordinator/farm/client.
#pragma once

#include <thread>

#include "common/base/clock.h"
#include "coordinator/farm/client/link.h"

namespace kiln {

class ServiceClientImpl final : public ServiceClient {
 public:
  explicit ServiceClientImpl(ClientOptions options) : options_(std::move(options)) {}
  Status open();
  const std::string& role() const override { return role_; }
  Expected<std::string> call(const std::string& verb, const std::string& document) override;
  Status upload(const std::filesystem::path& file, const Digest& digest, uint64_t size,
                const Progress& progress) override;
  Status download(const Wanted& wanted, const std::filesystem::path& file, const Progress& progress) override;

 private:
  // One attempt on one connection: kUnavailable with `link_` reset means that the connection was lost.
  Expected<std::string> ask(const std::string& verb, const std::string& document);
  Status send_file(const std::filesystem::path& file, const Digest& digest, uint64_t size,
                   const Progress& progress);
  Status receive_file(const Wanted& wanted, const std::filesystem::path& part, const Progress& progress);
  // Retries on a new connection while connections are lost and the last progress was less than half a minute
  // ago.
  template <class Result, class Try>
  Result again(const Try& attempt);

  const ClientOptions options_;
  std::unique_ptr<ClientConnection> link_;
  std::string role_;
  uint64_t last_id_ = 0;
  uint64_t moved_ = 0;  // counts progress
  SteadyClock clock_;
};

template <class Result, class Try>
Result ServiceClientImpl::again(const Try& attempt) {
  constexpr int64_t kPatienceMs = 30'000;
  int64_t begun = clock_.now_ms();
  for (;;) {
    const uint64_t before = moved_;
    Status open_status = link_ ? Status{} : open();
    if (open_status) {
      Result result = attempt();
      if (result || link_) return result;
      open_status = tl::unexpected<Error>(result.error());
    }
    const Error error = open_status.error();
    if (error.kind != ErrorKind::kUnavailable) return tl::unexpected<Error>(error);
    if (moved_ != before) begun = clock_.now_ms();
    if (clock_.now_ms() - begun > kPatienceMs) return tl::unexpected<Error>(error);
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
  }
}

}  // namespace kiln
