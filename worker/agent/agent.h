// A worker's life: connect, fetch jobs' chunks, make them ready, bake units, return results, leave in order.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/tls/identity.h"
#include "worker/bake/baker.h"

namespace kiln {

using BakerFactory =
    std::function<Expected<std::unique_ptr<Baker>>(Scene, Atlas, const TransportSettings&, unsigned threads)>;
using NumericClassFunction = std::function<Expected<std::string>(const std::string& isa)>;

struct AgentSettings {
  std::string host = "127.0.0.1";
  uint16_t port = 0;
  std::string token;
  std::string name;  // for people; empty: the machine's
  TlsFiles tls;  // PEM files, read at each connection: a renewed certificate needs no new start; empty: plain
  uint32_t threads = 1;
  int64_t patience_ms = 600000;     // without a coordinator before the worker gives up
  int64_t drain_limit_ms = 60000;   // for units that run when it is told to go
  int64_t unit_limit_ms = 3600000;  // of one unit: longer is a hang
  uint64_t memory_bytes = 0;        // for ready jobs (3/4) and chunks (1/4); 0: default_memory_budget()
  std::string cache_folder;         // of chunks; empty: none
  uint64_t cache_bytes = uint64_t{16} << 30;
  uint64_t kept_bytes = uint64_t{256} << 20;  // of results that wait for their acknowledgement: above it no
                                              // units are wanted until half is acknowledged
  std::string alive_file;                     // its time is set every second; empty: none
  std::string engine;                         // ray-tracing library, for the coordinator's records
  // The bake itself. Neither is called before Hello is on its way.
  BakerFactory make_baker;
  NumericClassFunction numeric_class;
};

// Returns when the coordinator said goodbye, after SIGTERM or SIGINT (running units are finished and
// delivered, the rest handed back), or with an error: kUsage if the coordinator refused this worker,
// kUnavailable if none was reachable for patience_ms, kInternal when a unit ran longer than unit_limit_ms.
// Bake threads may still run after an error or a goodbye, because a unit cannot be interrupted: leave the
// process by std::_Exit.
Status run_agent(const AgentSettings& settings);

}  // namespace kiln
