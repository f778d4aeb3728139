// Notices that a machine will be taken away, from a metadata service that is made up here.
#include "worker/agent/preemption.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <atomic>
#include <fstream>
#include <map>

#include "common/base/format.h"
#include "tests/support/paths.h"

namespace kiln {
namespace {

// Answers "METHOD path" with 200 and the text given for it, everything else with 404. A header that the path
// needs is part of the key after a space.
class Metadata {
 public:
  explicit Metadata(std::map<std::string, std::string> answers) : answers_(std::move(answers)) {
    listener_ = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    EXPECT_EQ(::bind(listener_, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
    EXPECT_EQ(::listen(listener_, 16), 0);
    socklen_t size = sizeof address;
    ::getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size);
    port_ = ntohs(address.sin_port);
    thread_ = std::thread([this] { serve(); });
  }
  ~Metadata() {
    end_ = true;
    thread_.join();
    ::close(listener_);
  }
  PreemptionSettings settings(Cloud cloud) const {
    PreemptionSettings s;
    s.cloud = cloud;
    s.address = "127.0.0.1";
    s.port = port_;
    s.every = std::chrono::milliseconds(1);
    return s;
  }

 private:
  void serve() {
    while (!end_) {
      pollfd ready{listener_, POLLIN, 0};
      if (::poll(&ready, 1, 20) != 1) continue;
      const int caller = ::accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC);
      std::string head;
      char buffer[1024];
      while (head.find("\r\n\r\n") == head.npos) {
        const ssize_t got = ::recv(caller, buffer, sizeof buffer, 0);
        if (got <= 0) break;
        head.append(buffer, static_cast<size_t>(got));
      }
      const std::string answer = answer_to(head);
      (void)!::send(caller, answer.data(), answer.size(), MSG_NOSIGNAL);
      ::close(caller);
    }
  }
  std::string answer_to(const std::string& head) const {
    for (const auto& [key, body] : answers_) {
      const size_t cut = key.find(" | ");
      const bool header = cut == key.npos || head.find("\r\n" + key.substr(cut + 3) + "\r\n") != head.npos;
      if (head.starts_with(key.substr(0, cut) + " HTTP/1.1\r\n") && header)
        return text("HTTP/1.1 200 OK\r\nContent-Length: {}\r\nConnection: close\r\n\r\n{}", body.size(),
                    body);
    }
    return "HTTP/1.1 404 Not Found\r\nContent-Length: 0\r\nConnection: close\r\n\r\n";
  }

  const std::map<std::string, std::string> answers_;
  int listener_ = -1, port_ = 0;
  std::atomic<bool> end_{false};
  std::thread thread_;
};

TEST(Preemption, AwsIsAskedWithATokenAndSaysNothingUntilThereIsSomething) {
  const std::string token = "PUT /latest/api/token | X-aws-ec2-metadata-token-ttl-seconds: 60";
  const std::string action =
      "GET /latest/meta-data/spot/instance-action | X-aws-ec2-metadata-token: the-token";
  EXPECT_EQ(preemption_notice(Metadata({{token, "the-token"}}).settings(Cloud::kAws)), "");
  const Metadata taken({{token, "the-token"}, {action, R"({"action": "terminate"})"}});
  EXPECT_EQ(preemption_notice(taken.settings(Cloud::kAws)), "AWS will take this machine");
  const Metadata no_token({{action, R"({"action": "terminate"})"}});
  EXPECT_EQ(preemption_notice(no_token.settings(Cloud::kAws)), "");
}

TEST(Preemption, GoogleSaysTrueOrFalse) {
  const std::string key = "GET /computeMetadata/v1/instance/preempted | Metadata-Flavor: Google";
  EXPECT_EQ(preemption_notice(Metadata({{key, "FALSE"}}).settings(Cloud::kGcp)), "");
  EXPECT_EQ(preemption_notice(Metadata({{key, "TRUE"}}).settings(Cloud::kGcp)),
            "Google Cloud will take this machine");
}

TEST(Preemption, AzureListsEvents) {
  const std::string key = "GET /metadata/scheduledevents?api-version=2020-07-01 | Metadata: true";
  const auto notice = [&](const std::string& document) {
    return preemption_notice(
        Metadata(std::map<std::string, std::string>({{key, document}})).settings(Cloud::kAzure));
  };
  EXPECT_EQ(notice(R"({"DocumentIncarnation": 1, "Events": []})"), "");
  EXPECT_EQ(notice(R"({"Events": [{"EventType": "Reboot"}]})"), "");
  EXPECT_EQ(notice(R"({"Events": [{"EventType": "Reboot"}, {"EventType": "Preempt"}]})"),
            "Azure will take this machine");
  EXPECT_EQ(notice("{\"Events\": 7"), "");
  EXPECT_EQ(notice(std::string(1u << 20, '[')), "");
}

TEST(Preemption, AServiceThatIsNotThereIsNoNotice) {
  PreemptionSettings settings;
  {
    const Metadata gone(std::map<std::string, std::string>{});
    settings = gone.settings(Cloud::kGcp);
  }
  EXPECT_EQ(preemption_notice(settings), "");
  EXPECT_EQ(preemption_notice({}), "");
}

TEST(Preemption, AFileIsANoticeAndIsToldOnce) {
  const test::TempDir folder;
  PreemptionSettings settings;
  settings.file = (folder.path() / "drain").string();
  settings.every = std::chrono::milliseconds(1);
  std::atomic<int> told{0};
  PreemptionWatch watch(settings, [&](const std::string& why) {
    EXPECT_NE(why.find("drain exists"), why.npos);
    ++told;
  });
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(told, 0);
  std::ofstream(settings.file) << "maintenance at noon\n";
  while (told == 0) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  std::this_thread::sleep_for(std::chrono::milliseconds(20));
  EXPECT_EQ(told, 1);
}

}  // namespace
}  // namespace kiln
