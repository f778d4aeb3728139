// A worker's life: connect, fetch a job's chunks, make it ready, bake units, return results, leave in order.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "worker/bake/baker.h"

namespace kiln {

using BakerFactory =
    std::function<Expected<std::unique_ptr<Baker>>(Scene, Atlas, const TransportSettings&, unsigned threads)>;
using NumericClassFunction = std::function<Expected<std::string>(const std::string& isa)>;

struct AgentSettings {
  std::string host = "127.0.0.1";
  uint16_t port = 0;
  std::string token;
  uint32_t threads = 1;
  int64_t patience_ms = 600000;  // without a coordinator before the worker gives up
  std::string engine;            // ray-tracing library, for the coordinator's records
  // The bake itself. Neither is called before Hello is on its way.
  BakerFactory make_baker;
  NumericClassFunction numeric_class;
};

// Returns when the coordinator said goodbye, after SIGTERM or SIGINT (running units are finished and
// delivered, the rest handed back), or with an error: kUsage if the coordinator refused this worker,
// kUnavailable if none was reachable for patience_ms. Bake threads may still run after an error or a
// goodbye, because a unit cannot be interrupted: leave the process by std::_Exit.
Status run_agent(const AgentSettings& settings);

}  // namespace kiln
