#include "worker/agent/socket_environment.h"

#include <fcntl.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <array>
#include <random>

#include "common/base/files.h"
#include "common/base/log.h"
#include "common/base/release.h"
#include "common/wire/listener.h"

namespace kiln {
namespace {

constexpr auto kConnectPatience = std::chrono::milliseconds(10000);

std::string host_name() {
  std::array<char, 256> name{};
  ::gethostname(name.data(), name.size() - 1);
  return name.data();
}

std::string best_isa() {
  if (__builtin_cpu_supports("avx512f") && __builtin_cpu_supports("avx512vl")) return "avx512";
  if (__builtin_cpu_supports("avx2")) return "avx2";
  if (__builtin_cpu_supports("avx")) return "avx";
  return __builtin_cpu_supports("sse4.2") ? "sse4.2" : "sse2";
}

}  // namespace

SocketEnvironment::SocketEnvironment(const AgentSettings& settings)
    : settings_(settings), pool_(settings.threads, [this](const Unit& unit, auto result) {
        loop_.post(
            [this, unit, result = std::move(result)]() mutable { on_baked_(unit, std::move(result)); });
      }) {
  if (!settings_.cache_folder.empty()) disk_ = DiskCache::open(settings_.cache_folder, settings_.cache_bytes);
  if (disk_) disk_thread_ = std::make_unique<TaskQueue>();
}

void SocketEnvironment::watch_for_the_end(std::function<void(const std::string&)> drain) {
  loop_.on_signals({SIGTERM, SIGINT}, [drain](int) { drain("told to stop by a signal"); });
  if (settings_.preemption.asks())
    preemption_ = std::make_unique<PreemptionWatch>(
        settings_.preemption,
        [this, drain](const std::string& notice) { loop_.post([drain, notice] { drain(notice); }); });
}

uint64_t SocketEnvironment::draw() {
  std::random_device device;
  return uint64_t{device()} << 32 | device();
}

Hello SocketEnvironment::hello() {
  Hello hello;
  hello.version = release_number();
  hello.token = settings_.token;
  hello.host = settings_.name.empty() ? host_name() : settings_.name;
  hello.pid = static_cast<uint32_t>(::getpid());
  hello.threads = settings_.threads;
  hello.isa = best_isa();
  hello.engine = settings_.engine;
  return hello;
}

void SocketEnvironment::connect(std::function<void(Expected<std::unique_ptr<Link>>)> done) {
  if (!settings_.tls.ca.empty()) {
    auto tls = TlsContext::load(settings_.tls);
    if (!tls) {
      // Files that were valid before may be in the middle of being replaced.
      const ErrorKind kind = tls_ ? ErrorKind::kUnavailable : ErrorKind::kUsage;
      return loop_.post([done, kind, why = tls.error().message] { done(fail(kind, why)); });
    }
    tls_ = *tls;
  }
  const auto connected = [done](Expected<std::unique_ptr<Connection>> connection) {
    if (!connection) return done(fail(ErrorKind::kUnavailable, connection.error().message));
    done(make_link(std::move(*connection)));
  };
  connect_to(loop_, settings_.host, settings_.port, kConnectPatience, connected, tls_);
}

void SocketEnvironment::classify(const std::string& isa, std::function<void(Expected<std::string>)> done) {
  classifier_ = std::jthread([this, isa, done] {
    auto name = settings_.numeric_class(isa);
    loop_.post([done, name = std::move(name)] { done(name); });
  });
}

void SocketEnvironment::prepare(const JobSpec& job, JobChunks chunks, Prepared done) {
  preparer_ = std::jthread([this, job, chunks = std::move(chunks), done]() mutable {
    auto baker = make_ready_baker(job, chunks, settings_);
    chunks.clear();
    loop_.post([done, baker = std::move(baker)] { done(baker); });
  });
}

void SocketEnvironment::bake(BakeTask task, std::function<void(const Unit&, Expected<UnitResult>)> done) {
  if (!on_baked_) on_baked_ = std::move(done);
  pool_.add(std::move(task));
}

std::vector<Unit> SocketEnvironment::take_unbegun(const std::function<bool(const Unit&)>& wanted) {
  return pool_.take_unbegun(wanted);
}

void SocketEnvironment::look_up(std::vector<Digest> ids, std::function<void(std::vector<ChunkBytes>)> done) {
  disk_thread_->add([this, ids = std::move(ids), done] {
    std::vector<ChunkBytes> found;
    for (const Digest& id : ids) found.push_back(disk_->read(id));
    loop_.post([done, found] { done(found); });
  });
}

void SocketEnvironment::store(const Digest& id, ChunkBytes bytes) {
  if (disk_) disk_thread_->add([this, id, bytes = std::move(bytes)] { disk_->write(id, *bytes); });
}

std::string SocketEnvironment::replay_file(uint64_t job, uint64_t unit) const {
  return disk_->replay_file(job, unit).string();
}

Status SocketEnvironment::keep_replay(const std::string& file, const std::string& content) {
  KILN_TRY_STATUS(write_file_atomic(file, content));
  disk_->shrink_replays();
  return {};
}

void SocketEnvironment::touch_alive_file() {
  if (settings_.alive_file.empty()) return;
  const int fd = ::open(settings_.alive_file.c_str(), O_CREAT | O_WRONLY | O_CLOEXEC, 0644);
  if (fd < 0) return;
  ::futimens(fd, nullptr);
  ::close(fd);
}

}  // namespace kiln
