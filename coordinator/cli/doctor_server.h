// The doctor's conversation with a coordinator. Internal to coordinator/cli.
#pragma once

#include <string>

#include "coordinator/cli/doctor_steps.h"

namespace kiln {

struct ResolvedName {
  std::string first;  // address
  size_t count = 0;
};
Expected<ResolvedName> resolve_name(const std::string& host);

enum class Reach { kOpen, kRefused, kNoAnswer, kNoRoute, kOther };
struct Reached {
  Reach how;
  std::string words;  // the system's message
  double ms = 0;
};
Reached reach_port(const std::string& host, uint16_t port, int patience_ms);

// How far the wire handshake got.
struct Greeting {
  enum { kNothing, kRefused, kWelcome } end = kNothing;
  std::string words;    // why it ended: the peer's or the connection's message
  std::string release;  // from a welcome to a client
  std::string role;
  std::string document;                   // reply to "status", as a client
  int64_t asked_ms = 0, answered_ms = 0;  // Unix time here
  std::string status_error;               // why there is no document
  int64_t certificate_until = 0;          // the coordinator's, seconds since 1970; 0: no TLS
};
Greeting greet_server(const DoctorPlan& plan, const std::string& host, uint16_t port);

}  // namespace kiln
