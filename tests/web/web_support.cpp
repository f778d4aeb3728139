#include "tests/web/web_support.h"

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include <cstdlib>

namespace kiln::test {

FakeFarm::FakeFarm() {
  farm.workers = {
      {1, "render7", "render7", "10.0.0.7:4000", "0.1.0", 16, 2, "baking", 18, 18, 900, 1, 5000000, 2.5e6, 12,
       0},
      {2, "render8", "render8", "10.0.0.8:4000", "0.1.0", 8, 0, "idle", 0, 0, 10, 0, 7000, 0, 3, 0},
      {3, "<img src=x onerror=alert(1)>", "x", "10.0.0.9:1", "0.1.0", 4, 2, "silent", 6, 6, 3, 2, 100, 0, 0,
       77}};
  farm.jobs = {{2, "ada", 1, 2, 20, 300, 1200, 1, 4000, 16000, 123456789, 40, 260, 5, 1}};
  farm.connections = 5, farm.clients = 2, farm.results = 913, farm.rays = 987654321, farm.duplicates = 4;
  farm.refused_connections = 6, farm.expelled = 1;
  const auto add = [&](const char* name, const char* user, JobState state, const char* reason) {
    JobRecord job;
    job.id = jobs.size() + 1;
    job.name = name, job.user = user, job.state = state, job.reason = reason;
    job.scene = "arcade.gltf";
    job.settings = "{\"error\": \"0.05\"}";
    job.inputs = {{"arcade.gltf", {}, 1234}};
    jobs.push_back(job);
  };
  add("arcade", "ada", JobState::kDone, "");
  add("harbour \"night\"\n\\", "ada", JobState::kBaking, "");
  add("<script>alert(1)</script>", "b\"ob", JobState::kQueued, "4 of at most 4 jobs are active");
  add("cellar", "eve", JobState::kFailed, "unit 7 failed 3 times, the last time because render9 was lost");
  jobs[1].passes_done = 1;
  events = {{1700000000000, "render7 joined with 16 threads"}};
  WorkerRecord liar;
  liar.identity = "render3";
  liar.quarantined = true;
  liar.quarantine_reason = "its answers to unit 7 differ from two others'";
  workers = {liar};
  health.release = "0.1.0";
  health.wal_bytes = 4096;
  health.tls = true;
  health.certificate_until = 1800000000;
  health.damaged_results = 3;
  health.data.sizes = {1000, 200, 30, 4, 5};
  health.data.bytes_a_day = {100, 10, -1, 0, 0.5};
  health.data.disk_bytes = 5000000, health.data.free_bytes = 2190;
  health.data.days_until_full = 20;
  health.data.keep_days = 30;
  health.data.next = {1700000000000, {1, 4}, 77};
  health.data.backup_ms = 1690000000000;
}

FarmSource FakeFarm::source() const {
  FarmSource s;
  s.farm = [this] { return farm; };
  s.jobs = [this] { return jobs; };
  s.job = [this](JobId id) -> std::optional<JobRecord> {
    if (id < 1 || id > jobs.size()) return std::nullopt;
    return jobs[id - 1];
  };
  s.events = [this](JobId) { return events; };
  s.progress = [](JobId id) -> std::optional<JobProgress> {
    if (id != 2) return std::nullopt;
    return JobProgress{"bake", 2, 30};
  };
  s.workers = [this] { return workers; };
  s.health = [this] { return health; };
  return s;
}

std::string say(uint16_t port, const std::string& bytes, int patience_ms) {
  const int fd = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  std::string answer;
  if (::connect(fd, reinterpret_cast<const sockaddr*>(&address), sizeof address) == 0) {
    (void)!::send(fd, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    char buffer[4096];
    for (pollfd ready{fd, POLLIN, 0}; ::poll(&ready, 1, patience_ms) == 1;) {
      const ssize_t got = ::recv(fd, buffer, sizeof buffer, 0);
      if (got <= 0) break;
      answer.append(buffer, static_cast<size_t>(got));
    }
  }
  ::close(fd);
  return answer;
}

std::string get(uint16_t port, const std::string& path, const std::string& headers) {
  return say(port, "GET " + path + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n");
}

int status_of(const std::string& answer) {
  return answer.rfind("HTTP/1.1 ", 0) == 0 ? std::atoi(answer.c_str() + 9) : 0;
}

std::string content_of(const std::string& answer) {
  const size_t end = answer.find("\r\n\r\n");
  return end == answer.npos ? "" : answer.substr(end + 4);
}

}  // namespace kiln::test
