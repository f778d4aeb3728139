#include "coordinator/farm/web/web_server.h"

#include <charconv>

#include "common/base/format.h"
#include "common/base/hash.h"
#include "common/base/loopback.h"
#include "coordinator/farm/documents/farm_documents.h"
#include "coordinator/farm/web/answer_pool.h"
#include "coordinator/farm/web/metrics.h"
#include "coordinator/farm/web/page.h"
#include "coordinator/farm/web/response.h"

namespace kiln {
namespace {

constexpr size_t kMaxJobs = 1000;  // of /api/jobs.json, the newest

Response json_response(std::string document) {
  return {200, "application/json", std::move(document)};
}

}  // namespace

struct WebServer::Impl {
  Impl(const WebSettings& s, FarmSource from)
      : settings(s), source(std::move(from)), pool(settings.threads, settings.waiting) {}

  // On the loop's thread.
  void take(uint64_t connection, RequestHead head) {
    // Alive is whoever reads this: not the disk, the farm or a free thread may decide it.
    if (head.path == "/livez") return loop->reply(connection, write_response(plain_response(200, "ok")));
    const bool taken = pool.give([this, connection, head = std::move(head)] {
      Response response;
      try {
        response = answer(head);
      } catch (const std::exception&) {  // memory, most likely: the next request may fit
        response = plain_response(500, "this page could not be made");
      }
      loop->reply(connection, write_response(response));
    });
    if (!taken)
      loop->reply(connection, write_response(plain_response(503, "too many requests wait: try again later")));
  }

  bool may_read(const RequestHead& head) const {
    if (settings.token.empty()) return true;
    return equal_secret(head.authorization, "Bearer " + settings.token);
  }

  Response answer(const RequestHead& head) const {
    // DNS rebinding: a page from elsewhere must not read data that needs no token.
    if (settings.token.empty() && !is_loopback_authority(head.host))
      return plain_response(421, "this server answers requests for localhost only");
    const bool trusted = may_read(head);
    // /healthz: the name before there were two.
    if (head.path == "/readyz" || head.path == "/healthz") {
      const std::string why = held_for(source);
      if (why.empty()) return plain_response(200, "ok");
      return plain_response(503, trusted ? "nothing is handed out: " + why : "nothing is handed out");
    }
    if (head.path == "/") {
      const std::string nonce = random_hex(16);
      return {200, "text/html; charset=utf-8", status_page(nonce),
              "Content-Security-Policy: " + page_policy(nonce) + "\r\n"};
    }
    if (!trusted) {
      Response refusal = plain_response(401, "give the token of this server: Authorization: Bearer TOKEN");
      refusal.headers = "WWW-Authenticate: Bearer realm=\"kiln\"\r\n";
      return refusal;
    }
    return answer_data(head.path);
  }

  Response answer_data(const std::string& path) const {
    if (path == "/metrics") return {200, kMetricsType, write_metrics(source)};
    if (path == "/api/status.json") return json_response(status_document(source));
    if (path == "/api/workers.json") return json_response(workers_document(source));
    if (path == "/api/jobs.json") return json_response(jobs_document(source, {0, kMaxJobs}));
    constexpr std::string_view kBefore = "/api/jobs/", kAfter = ".json";
    if (path.starts_with(kBefore) && path.ends_with(kAfter) && path.size() > kBefore.size() + kAfter.size()) {
      JobId id = 0;
      const char *first = path.data() + kBefore.size(), *last = path.data() + path.size() - kAfter.size();
      const auto [stop, code] = std::from_chars(first, last, id);
      if (code == std::errc() && stop == last)
        if (auto document = job_document(source, id)) return json_response(std::move(*document));
      return plain_response(404, "there is no such job");
    }
    return plain_response(
        404,
        "here are /, /metrics, /livez, /readyz, /api/status.json, /api/workers.json, /api/jobs.json and "
        "/api/jobs/ID.json");
  }

  const WebSettings settings;
  const FarmSource source;
  std::unique_ptr<HttpLoop> loop;  // replies of the pool's last work go to it: it ends after the pool
  AnswerPool pool;
};

WebServer::WebServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

WebServer::~WebServer() {
  impl_->loop->stop();
}

uint16_t WebServer::port() const {
  return impl_->loop->port();
}

Expected<std::unique_ptr<WebServer>> WebServer::start(const WebSettings& settings, FarmSource source) {
  if (!is_loopback(settings.host) && (!settings.beyond_loopback || settings.token.empty()))
    return fail(
        ErrorKind::kUsage,
        text("HTTP on {} would be read by others: listen on 127.0.0.1 behind a proxy that speaks TLS, "
             "or allow it and give a token",
             settings.host));
  auto impl = std::make_unique<Impl>(settings, std::move(source));
  KILN_TRY(impl->loop, HttpLoop::open(settings.host, settings.port, settings.limits));
  impl->loop->start([server = impl.get()](uint64_t connection, RequestHead head) {
    server->take(connection, std::move(head));
  });
  return std::unique_ptr<WebServer>(new WebServer(std::move(impl)));
}

}  // namespace kiln
