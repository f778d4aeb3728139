#include "coordinator/viewer/view_server.h"

#include <httplib.h>

#include <array>
#include <cstdlib>

#include "common/base/format.h"
#include "common/base/loopback.h"
#include "coordinator/viewer/served_files.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

constexpr const char* kPage = "/docs/examples/three/index.html?folder=/bake/";
// The page may run only what is served here; three's zstd decoder is WebAssembly in a data URL.
constexpr const char* kPolicy =
    "default-src 'none'; script-src 'self' 'unsafe-inline' 'wasm-unsafe-eval'; style-src 'unsafe-inline'; "
    "connect-src 'self' data: blob:; img-src 'self' data: blob:";

}  // namespace

struct ViewServer::Impl final : httplib::Server {
  explicit Impl(const ViewSettings& s) : settings(s) {
    // Not SO_REUSEPORT, the library's default: a second server on the port must fail.
    set_socket_options([](socket_t fd) {
      const int on = 1;
      ::setsockopt(fd, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
    });
    set_read_timeout(10);
    set_write_timeout(30);
    set_payload_max_length(0);
    set_pre_routing_handler([this](const httplib::Request& request, httplib::Response& response) {
      answer(request, response);
      return HandlerResponse::Handled;
    });
    set_exception_handler([](const httplib::Request&, httplib::Response& response, std::exception_ptr) {
      response.status = 500;
    });
  }

  static void say(httplib::Response& response, int status, const std::string& words) {
    response.status = status;
    response.set_content(words + "\n", "text/plain; charset=utf-8");
  }

  void answer(const httplib::Request& request, httplib::Response& response) const {
    response.set_header("Cache-Control", "no-cache");
    response.set_header("X-Content-Type-Options", "nosniff");
    response.set_header("Referrer-Policy", "no-referrer");
    response.set_header("Content-Security-Policy", kPolicy);
    if (request.method != "GET" && request.method != "HEAD") {
      response.set_header("Allow", "GET, HEAD");
      return say(response, 405, "only GET and HEAD are served");
    }
    // DNS rebinding: a foreign page whose name resolves to this address must not read the folder.
    if (!is_loopback_authority(request.get_header_value("Host")))
      return say(response, 421, "this server answers requests for localhost only");
    if (request.path == "/") return response.set_redirect(kPage);
    if (request.ranges.size() > 1) return say(response, 416, "request one range at a time");
    const std::pair<std::string_view, fs::path> folders[] = {
        {"/bake/", settings.bake},
        {"/docs/examples/three/", settings.share / "examples/three"},
        {"/docs/shaders/", settings.share / "shaders"}};
    for (const auto& [prefix, folder] : folders)
      if (request.path.starts_with(prefix)) return send(folder, request.path.substr(prefix.size()), response);
    say(response, 404, "only /, /bake/, /docs/examples/three/ and /docs/shaders/ are served");
  }

  static void send(const fs::path& folder, const std::string& path, httplib::Response& response) {
    const auto file = open_below(folder, path);
    if (!file) return say(response, 404, file.error().message);
    if ((*file)->size() == 0) return response.set_content("", mime_type_of(path));
    // Streamed: lightmaps may be larger than memory. For Range requests the library asks for a part.
    response.set_content_provider((*file)->size(), mime_type_of(path),
                                  [held = *file](size_t offset, size_t length, httplib::DataSink& sink) {
                                    std::array<char, 1 << 16> piece;
                                    const size_t got =
                                        held->read(offset, piece.data(), std::min(length, piece.size()));
                                    return got > 0 && sink.write(piece.data(), got);
                                  });
  }

  const ViewSettings settings;
  uint16_t port = 0;
  std::thread thread;
};

fs::path find_share() {
  if (const char* set = std::getenv("KILN_SHARE")) return set;
  std::error_code code;
  const fs::path program = fs::read_symlink("/proc/self/exe", code);
  const fs::path above = program.parent_path().parent_path(), installed = above / "share/kiln";
  // A program that is not installed stands in bin/ of a build folder in the sources.
  return fs::exists(installed / "examples/three/index.html", code) ? installed : above.parent_path() / "docs";
}

Status check_view(const ViewSettings& s) {
  const auto refuse = [](std::string why) { return fail(ErrorKind::kInvalidInput, std::move(why)); };
  std::error_code code;
  if (!fs::is_directory(s.bake, code))
    return refuse(text("{} is not a folder: give the one that kiln bake wrote", s.bake.string()));
  if (!fs::is_regular_file(s.bake / "scene.glb", code))
    return refuse(text("{} holds no scene.glb: give the folder that kiln bake wrote", s.bake.string()));
  const fs::path viewer = s.share / "examples/three";
  if (!fs::is_regular_file(viewer / "index.html", code))
    return refuse(text("the viewer is not in {}: set KILN_SHARE to the folder that holds examples/three",
                       s.share.string()));
  if (!fs::is_regular_file(viewer / "node_modules/three/build/three.module.js", code))
    return refuse(text("three.js is not installed: npm ci --prefix {}", viewer.string()));
  return {};
}

ViewServer::ViewServer(std::unique_ptr<Impl> impl) : impl_(std::move(impl)) {}

ViewServer::~ViewServer() {
  impl_->stop();
  if (impl_->thread.joinable()) impl_->thread.join();
}

uint16_t ViewServer::port() const {
  return impl_->port;
}

Expected<std::unique_ptr<ViewServer>> ViewServer::start(const ViewSettings& settings) {
  KILN_TRY_STATUS(check_view(settings));
  auto impl = std::make_unique<Impl>(settings);
  constexpr const char* kHost = "127.0.0.1";
  const bool bound =
      settings.port == 0
          ? (impl->port = static_cast<uint16_t>(std::max(0, impl->bind_to_any_port(kHost)))) != 0
          : impl->bind_to_port(kHost, impl->port = settings.port);
  if (!bound)
    return fail(ErrorKind::kIo,
                text("port {} of this machine is taken: choose another with --port, or none for "
                     "any free one",
                     settings.port));
  impl->thread = std::thread([server = impl.get()] { server->listen_after_bind(); });
  while (!impl->is_running()) std::this_thread::sleep_for(std::chrono::milliseconds(1));
  return std::unique_ptr<ViewServer>(new ViewServer(std::move(impl)));
}

}  // namespace kiln
