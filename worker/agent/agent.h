// The worker's main loop: connect, fetch jobs' chunks, prepare jobs, bake units, return results, shut down
// cleanly.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "common/tls/identity.h"
#include "worker/agent/preemption.h"
#include "worker/bake/baker.h"

namespace kiln {

using BakerFactory =
    std::function<Expected<std::unique_ptr<Baker>>(Scene, Atlas, const TransportSettings&, unsigned threads)>;
using ProbeBakerFactory = std::function<Expected<std::unique_ptr<Baker>>(
    Scene, ProbePoints, const TransportSettings&, unsigned threads)>;
using NumericClassFunction = std::function<Expected<std::string>(const std::string& isa)>;

struct AgentSettings {
  std::string host = "127.0.0.1";
  uint16_t port = 0;
  std::string token;
  std::string name;  // display name; empty: the machine's
  TlsFiles tls;  // PEM files, read at each connection, so that a renewed certificate needs no restart; empty:
                 // no TLS
  uint32_t threads = 1;
  int64_t patience_ms = 600000;     // without a coordinator before the worker gives up
  int64_t drain_limit_ms = 60000;   // for running units when told to stop
  int64_t unit_limit_ms = 3600000;  // per unit: longer is a hang
  uint64_t memory_bytes = 0;        // for ready jobs (3/4) and chunks (1/4); 0: default_memory_budget()
  std::string cache_folder;         // of chunks; empty: none
  uint64_t cache_bytes = uint64_t{16} << 30;
  uint64_t kept_bytes =
      uint64_t{256}
      << 20;  // of unacknowledged results: above it the worker requests no units until half is acknowledged
  PreemptionSettings preemption;  // a notice is like SIGTERM
  std::string record;             // file for the conversation (recording.h); empty: none
  std::string alive_file;         // touched every second; empty: none
  std::string engine;             // ray-tracing library, for the coordinator's records
  // The bake itself. Neither is called before Hello is queued.
  BakerFactory make_baker;
  ProbeBakerFactory make_probe_baker;  // empty: jobs of probes are refused
  NumericClassFunction numeric_class;
};

// Returns when the coordinator said goodbye, after SIGTERM, SIGINT or a preemption notice (running units are
// finished and delivered, the rest handed back), or with an error: kUsage if the coordinator refused this
// worker, kUnavailable if none was reachable for patience_ms, kInternal when a unit ran longer than
// unit_limit_ms. Bake threads may still run after an error or a goodbye, because a unit cannot be
// interrupted: end the process with std::_Exit.
Status run_agent(const AgentSettings& settings);

}  // namespace kiln
