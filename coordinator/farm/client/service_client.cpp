#include "common/base/format.h"
#include "coordinator/farm/client/client_impl.h"

namespace kiln {
namespace {

constexpr auto kReplyPatience = std::chrono::minutes(2);

}  // namespace

Status ServiceClientImpl::open() {
  link_.reset();
  KILN_TRY(link_, ClientConnection::open(options_));
  role_ = link_->role();
  return {};
}

Expected<std::string> ServiceClientImpl::ask(const std::string& verb, const std::string& document) {
  const uint64_t id = ++last_id_;
  link_->send(Request{id, verb, document});
  for (;;) {
    auto message = link_->next(kReplyPatience);
    if (!message) {
      link_.reset();
      return tl::unexpected<Error>(message.error());
    }
    auto* reply = std::get_if<Reply>(&*message);
    if (!reply || reply->id != id) continue;  // of the abandoned transfer
    ++moved_;
    if (reply->ok) return std::move(reply->document);
    return fail(reply->kind, reply->document);
  }
}

Expected<std::string> ServiceClientImpl::call(const std::string& verb, const std::string& document) {
  return again<Expected<std::string>>([&] { return ask(verb, document); });
}

Expected<std::unique_ptr<ServiceClient>> ServiceClient::connect(const ClientOptions& options) {
  auto client = std::make_unique<ServiceClientImpl>(options);
  KILN_TRY_STATUS(client->open());
  return std::unique_ptr<ServiceClient>(std::move(client));
}

}  // namespace kiln
