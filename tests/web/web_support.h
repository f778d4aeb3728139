// A farm that is not there, and a client that says any bytes.
#pragma once

#include <string>

#include "coordinator/farm/web/web_server.h"

namespace kiln::test {

struct FakeFarm {
  FarmStatus farm;
  std::vector<JobRecord> jobs;
  std::vector<JobEvent> events;
  std::vector<WorkerRecord> workers;
  FarmHealth health;
  FakeFarm();  // three workers, four jobs, names that need escapes
  FarmSource source() const;
};

// The whole answer, head and content; empty: the server closed without one.
std::string say(uint16_t port, const std::string& bytes, int patience_ms = 3000);
std::string get(uint16_t port, const std::string& path, const std::string& headers = "");
int status_of(const std::string& answer);           // 0: not HTTP
std::string content_of(const std::string& answer);  // after the head

}  // namespace kiln::test
