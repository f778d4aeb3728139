// The farm over HTTP, read-only: /metrics, /livez, /readyz, /api/status.json, /api/workers.json,
// /api/jobs.json, /api/jobs/ID.json and a page that shows them. Serves no files, accepts no content, answers
// one request per connection.
#pragma once

#include <memory>
#include <string>

#include "common/base/status.h"
#include "coordinator/farm/documents/farm_source.h"
#include "coordinator/farm/web/http_loop.h"

namespace kiln {

struct WebSettings {
  std::string host = "127.0.0.1";
  uint16_t port = 0;  // 0: any free port
  // Required as `Authorization: Bearer TOKEN` for metrics and documents; the page prompts for it. Empty:
  // none, loopback only.
  std::string token;
  bool beyond_loopback =
      false;  // explicitly set by the user: the token and all names are then sent in the clear
  HttpLimits limits;
  uint32_t threads = 4;   // that make answers
  uint32_t waiting = 64;  // requests that wait for one; further ones get 503
};

class WebServer {
 public:
  // Listens and returns; `source` is called from the server's own threads until it is destroyed.
  static Expected<std::unique_ptr<WebServer>> start(const WebSettings& settings, FarmSource source);
  ~WebServer();
  uint16_t port() const;

 private:
  struct Impl;
  explicit WebServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace kiln
