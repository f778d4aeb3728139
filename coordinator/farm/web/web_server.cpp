#include "coordinator/farm/web/web_server.h"

#include <fcntl.h>
#include <httplib.h>
#include <poll.h>

#include <charconv>

#include "common/base/format.h"
#include "common/base/loopback.h"
#include "coordinator/farm/web/documents.h"
#include "coordinator/farm/web/metrics.h"
#include "coordinator/farm/web/page.h"
#include "coordinator/farm/web/request_head.h"

namespace kiln {
namespace {

constexpr const char* kJson = "application/json";
thread_local bool too_many = false;                 // the accepting thread handles this connection itself
thread_local const RequestHead* current = nullptr;  // of the request handled by this thread

const char* phrase(int status) {
  switch (status) {
    case 405:
      return "Method Not Allowed";
    case 408:
      return "Request Timeout";
    case 413:
      return "Content Too Large";
    case 431:
      return "Request Header Fields Too Large";
    case 503:
      return "Service Unavailable";
    case 505:
      return "HTTP Version Not Supported";
    default:
      return "Bad Request";
  }
}

bool send_all(int socket, std::string_view bytes, std::chrono::milliseconds patience) {
  const auto limit = std::chrono::steady_clock::now() + patience;
  while (!bytes.empty()) {
    const auto left =
        std::chrono::duration_cast<std::chrono::milliseconds>(limit - std::chrono::steady_clock::now());
    pollfd ready{socket, POLLOUT, 0};
    if (left.count() <= 0 || ::poll(&ready, 1, static_cast<int>(left.count())) <= 0) return false;
    const ssize_t put = ::send(socket, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
    if (put < 0 && errno != EINTR && errno != EAGAIN) return false;
    if (put > 0) bytes.remove_prefix(static_cast<size_t>(put));
  }
  return true;
}

// The library reads the checked head, not the socket, and its response is buffered to be sent with one
// deadline.
class CheckedStream final : public httplib::Stream {
 public:
  explicit CheckedStream(std::string request) : request_(std::move(request)) {}
  bool is_readable() const override { return at_ < request_.size(); }
  bool is_writable() const override { return true; }
  ssize_t read(char* to, size_t size) override {
    const size_t count = request_.copy(to, size, at_);
    at_ += count;
    return static_cast<ssize_t>(count);
  }
  ssize_t write(const char* from, size_t size) override {
    answer_.append(from, size);
    return static_cast<ssize_t>(size);
  }
  void get_remote_ip_and_port(std::string&, int&) const override {}
  void get_local_ip_and_port(std::string&, int&) const override {}
  socket_t socket() const override { return INVALID_SOCKET; }
  const std::string& answer() const { return answer_; }

 private:
  std::string request_, answer_;
  size_t at_ = 0;
};

// A fixed number of threads and of queued connections; further ones are answered on the accepting thread.
class BoundedPool final : public httplib::TaskQueue {
 public:
  BoundedPool(uint32_t threads, uint32_t waiting) : pool_(threads), most_(threads + waiting) {}
  void enqueue(std::function<void()> work) override {
    if (inside_.fetch_add(1) >= most_) {
      too_many = true;
      work();
      too_many = false;
      --inside_;
      return;
    }
    pool_.enqueue([this, work = std::move(work)] {
      work();
      --inside_;
    });
  }
  void shutdown() override { pool_.shutdown(); }

 private:
  httplib::ThreadPool pool_;
  const uint32_t most_;
  std::atomic<uint32_t> inside_{0};
};

}  // namespace

struct WebServer::Impl final : httplib::Server {
  Impl(const WebSettings& s, WebSources from) : settings(s), sources(std::move(from)) {
    new_task_queue = [this] { return new BoundedPool(settings.threads, settings.waiting); };
    // Not SO_REUSEPORT, the library's choice: a second server on the port is an error.
    set_socket_options([](socket_t fd) {
      const int on = 1;
      ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    });
    set_pre_routing_handler([this](const httplib::Request&, httplib::Response& response) {
      answer(*current, response);
      return HandlerResponse::Handled;
    });
    set_exception_handler([](const httplib::Request&, httplib::Response& response, std::exception_ptr) {
      response.status = 500;
    });
  }

  void say(httplib::Response& response, int status, const std::string& words) {
    response.status = status;
    response.set_content(words + "\n", "text/plain; charset=utf-8");
  }

  bool may_read(const RequestHead& head) const {
    if (settings.token.empty()) return true;
    return equal_secret(head.authorization, "Bearer " + settings.token);
  }

  void answer(const RequestHead& head, httplib::Response& response) {
    response.set_header("Cache-Control", "no-store");
    response.set_header("X-Content-Type-Options", "nosniff");
    response.set_header("Referrer-Policy", "no-referrer");
    // DNS rebinding: a page from elsewhere must not read data that needs no token.
    if (settings.token.empty() && !is_loopback_authority(head.host))
      return say(response, 421, "this server answers requests for localhost only");
    const bool trusted = may_read(head);
    if (head.path == "/healthz") {
      const std::string why = unhealthy(sources);
      return say(response, why.empty() ? 200 : 503,
                 why.empty() ? "ok"
                 : trusted   ? "nothing is handed out: " + why
                             : "nothing is handed out");
    }
    if (head.path == "/") {
      const std::string nonce = random_hex(16);
      response.status = 200;
      response.set_header("Content-Security-Policy", page_policy(nonce));
      return response.set_content(status_page(nonce), "text/html; charset=utf-8");
    }
    if (!trusted) {
      response.set_header("WWW-Authenticate", "Bearer realm=\"kiln\"");
      return say(response, 401, "give the token of this server: Authorization: Bearer TOKEN");
    }
    answer_data(head.path, response);
  }

  void answer_data(const std::string& path, httplib::Response& response) {
    response.status = 200;
    if (path == "/metrics") return response.set_content(write_metrics(sources), kMetricsType);
    if (path == "/api/status.json") return response.set_content(status_json(sources), kJson);
    if (path == "/api/jobs.json") return response.set_content(jobs_json(sources), kJson);
    constexpr std::string_view kBefore = "/api/jobs/", kAfter = ".json";
    if (path.starts_with(kBefore) && path.ends_with(kAfter) && path.size() > kBefore.size() + kAfter.size()) {
      JobId id = 0;
      const char *first = path.data() + kBefore.size(), *last = path.data() + path.size() - kAfter.size();
      const auto [stop, code] = std::from_chars(first, last, id);
      if (code == std::errc() && stop == last)
        if (const auto document = job_json(sources, id)) return response.set_content(*document, kJson);
      return say(response, 404, "there is no such job");
    }
    say(response, 404,
        "here are /, /metrics, /healthz, /api/status.json, /api/jobs.json and /api/jobs/ID.json");
  }

  // Replaces the library's, whose timeout restarts with every byte of a slow peer.
  bool process_and_close_socket(socket_t fd) override {
    ::fcntl(fd, F_SETFD, FD_CLOEXEC);
    if (too_many) {
      refuse(fd, {503, "too many connections: try again later"}, std::chrono::milliseconds(0));
      ::close(fd);
      return false;
    }
    const auto head = read_request_head(fd, settings.patience);
    if (!head) {
      refuse(fd, head.error(), std::chrono::milliseconds(200));
      ::close(fd);
      return false;
    }
    // The library sees none of the peer's headers: no Range, no encoding, no escapes.
    CheckedStream stream("GET / HTTP/1.1\r\nHost: kiln\r\n\r\n");
    current = &*head;
    bool closed = false;
    process_request(stream, true, closed, {});
    const bool sent = send_all(fd, stream.answer(), settings.patience);
    ::shutdown(fd, SHUT_WR);
    ::close(fd);
    return sent;
  }

  // Drain the peer's remaining bytes briefly: otherwise a reset could overtake the response.
  void refuse(socket_t fd, const HeadRefused& refused, std::chrono::milliseconds drain) {
    if (refused.status == 0) return;
    send_all(fd,
             text("HTTP/1.1 {} {}\r\nContent-Type: text/plain; charset=utf-8\r\nContent-Length: {}\r\n"
                  "{}Connection: close\r\n\r\n{}\n",
                  refused.status, phrase(refused.status), refused.why.size() + 1,
                  refused.status == 405 ? "Allow: GET\r\n" : "", refused.why),
             std::min(settings.patience, std::chrono::milliseconds(200)));
    ::shutdown(fd, SHUT_WR);
    const auto limit = std::chrono::steady_clock::now() + drain;
    char dropped[4096];
    for (size_t bytes = 0; bytes < (64u << 10) && std::chrono::steady_clock::now() < limit;) {
      pollfd ready{fd, POLLIN, 0};
      if (::poll(&ready, 1, 20) <= 0) continue;
      const ssize_t got = ::recv(fd, dropped, sizeof dropped, MSG_DONTWAIT);
      if (got <= 0) return;
      bytes += static_cast<size_t>(got);
    }
  }

  const WebSettings settings;
  const WebSources sources;
  uint16_t port = 0;
  std::thread thread;
};

WebServer::WebServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

WebServer::~WebServer() {
  impl_->stop();
  if (impl_->thread.joinable()) impl_->thread.join();
}

uint16_t WebServer::port() const {
  return impl_->port;
}

Expected<std::unique_ptr<WebServer>> WebServer::start(const WebSettings& settings, WebSources sources) {
  if (!is_loopback(settings.host) && (!settings.beyond_loopback || settings.token.empty()))
    return fail(
        ErrorKind::kUsage,
        text("HTTP on {} would be read by others: listen on 127.0.0.1 behind a proxy that speaks TLS, "
             "or allow it and give a token",
             settings.host));
  auto impl = std::make_unique<Impl>(settings, std::move(sources));
  const bool bound =
      settings.port == 0
          ? (impl->port = static_cast<uint16_t>(std::max(0, impl->bind_to_any_port(settings.host)))) != 0
          : impl->bind_to_port(settings.host, impl->port = settings.port);
  if (!bound)
    return fail(ErrorKind::kIo,
                text("cannot serve HTTP on {}:{}: another program has the port, or the name is "
                     "not this machine's; choose another, or 0 for any free one",
                     settings.host, settings.port));
  impl->thread = std::thread([server = impl.get()] { server->listen_after_bind(); });
  while (!impl->is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return std::unique_ptr<WebServer>(new WebServer(std::move(impl)));
}

}  // namespace kiln
