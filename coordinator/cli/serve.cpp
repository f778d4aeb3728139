#include <pthread.h>
#include <signal.h>
#include <sys/stat.h>

#include <cstdio>
#include <cstdlib>
#include <ctime>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/hash.h"
#include "common/base/log.h"
#include "common/base/loopback.h"
#include "common/base/parallel.h"
#include "common/base/release.h"
#include "common/tls/identity.h"
#include "common/wire/listener.h"
#include "coordinator/cli/service_options.h"
#include "coordinator/farm/web/web_server.h"
#include "coordinator/service/service.h"

namespace kiln {
namespace {

constexpr auto kStopPatience = std::chrono::seconds(25);

Expected<std::string> read_token(const std::string& file) {
  KILN_TRY(const Bytes bytes, read_file(file, 4096));
  std::string token(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  token.resize(std::min(token.find_first_of("\r\n"), token.size()));
  if (token.size() < 16)
    return fail(ErrorKind::kUsage, text("{} holds no token of at least 16 characters", file));
  return token;
}

Expected<int64_t> number_of_option(const Arguments& a, const std::string& name, int64_t fallback,
                                   int64_t least, int64_t most) {
  if (!a.has(name)) return fallback;
  return parse_whole("--" + name, a.get(name), least, most);
}

// Accepts "host:0" too: an address to listen on need not have a port.
Expected<std::pair<std::string, uint16_t>> parse_listen_address(std::string address) {
  const bool any_port = address.ends_with(":0");
  if (any_port) address.back() = '1';
  KILN_TRY(auto parsed, parse_address(address));
  if (any_port) parsed.second = 0;
  return parsed;
}

// Of the pages: that of --http-token-file, or on other addresses than loopback DATA/web.token. Whoever looks
// at pages sends it with each, in the clear or through a proxy: it must open nothing else.
Expected<std::string> web_token(const Arguments& a, const ServiceSettings& s) {
  const bool given = a.has("http-token-file");
  KILN_TRY(const auto address, parse_listen_address(a.get("http")));
  if (!given && is_loopback(address.first)) return std::string();
  KILN_TRY(const ServiceTokens tokens, service_tokens(s.data));
  std::string token = tokens.web;
  if (given) {
    KILN_TRY(token, read_token(a.get("http-token-file")));
  }
  const std::string& workers = s.farm.token.empty() ? tokens.worker.shared : s.farm.token;
  for (const auto& [other, whose] :
       {std::pair(workers, "workers'"), std::pair(tokens.submit, "submit"), std::pair(tokens.admin, "admin")})
    if (equal_secret(token, other))
      return fail(ErrorKind::kUsage,
                  text("the token of --http is the {} token too: who may look could do more. Give "
                       "--http-token-file a file of its own, or leave it out: then {} is used",
                       whose, (s.data / "web.token").string()));
  return token;
}

Expected<std::unique_ptr<WebServer>> start_web(const Arguments& a, Service& service,
                                               const ServiceSettings& s) {
  if (!a.has("http")) return std::unique_ptr<WebServer>();
  WebSettings web;
  KILN_TRY(const auto address, parse_listen_address(a.get("http")));
  web.host = address.first;
  web.port = address.second;
  web.beyond_loopback = a.has("insecure-plain");
  KILN_TRY(web.token, web_token(a, s));
  return WebServer::start(web, service.source());
}

std::filesystem::path authority_of(const Arguments& a) {
  const std::filesystem::path data = a.get("data");
  return a.has("authority") ? std::filesystem::path(a.get("authority")) : data / "authority";
}

// `kiln cert revoke` writes into the authority's folder: where that is at hand, its list is read in place.
TlsFiles tls_files(const Arguments& a) {
  return {a.get("ca"), a.get("certificate"), a.get("key"), {authority_of(a) / "revoked"}};
}

// Of the machine's memory by default a quarter: the coordinator takes as much again for a job that has
// passed.
Status read_prepare_limits(const Arguments& a, ServiceSettings& s) {
  const auto quarter = static_cast<int64_t>(memory_bytes() >> 22);
  KILN_TRY(const int64_t mib,
           number_of_option(a, "prepare-memory", std::max<int64_t>(1024, quarter), 64, 1 << 24));
  KILN_TRY(const int64_t seconds, number_of_option(a, "prepare-time", 3600, 1, 1'000'000));
  s.prepare = {static_cast<uint64_t>(mib) << 20, seconds * 1000};
  std::error_code code;
  s.check_program = std::filesystem::read_symlink("/proc/self/exe", code).string();
  if (code) return fail(ErrorKind::kIo, text("cannot find this program's file: {}", code.message()));
  return {};
}

Expected<ServiceSettings> read_settings(const Arguments& a) {
  ServiceSettings s;
  s.data = a.get("data");
  s.release = release_number();
  s.authority = authority_of(a);
  KILN_TRY(const auto address, parse_listen_address(a.get("listen", "127.0.0.1:7800")));
  s.farm.listen_host = address.first;
  s.farm.listen_port = address.second;
  KILN_TRY(const int64_t workers, number_of_option(a, "local-workers", 0, 0, 256));
  s.farm.local_workers = static_cast<uint32_t>(workers);
  const auto share = std::max<int64_t>(1, hardware_threads() / std::max<int64_t>(1, workers));
  KILN_TRY(const int64_t threads, number_of_option(a, "threads", share, 1, 1024));
  s.farm.local_threads = static_cast<uint32_t>(threads);
  s.farm.worker_program = worker_program();
  KILN_TRY(const int64_t active, number_of_option(a, "active-jobs", 4, 1, 64));
  s.active_jobs = static_cast<uint32_t>(active);
  KILN_TRY(const int64_t days, number_of_option(a, "keep-days", 30, 1, 36500));
  s.keep_days = static_cast<uint32_t>(days);
  KILN_TRY(const int64_t scrub, number_of_option(a, "scrub", 8, 0, 100000));
  s.scrub_mib_s = static_cast<uint32_t>(scrub);
  KILN_TRY(const int64_t audit, number_of_option(a, "audit-first", 10, 0, 100000));
  s.farm.rules.audit_first = static_cast<uint32_t>(audit);
  s.farm.rules.audit_seed = std::strtoull(random_hex(8).c_str(), nullptr, 16);
  KILN_TRY_STATUS(read_prepare_limits(a, s));
  s.farm.plain_is_fine = a.has("insecure-plain");
  if (a.has("token-file")) {
    KILN_TRY(WorkerTokens tokens, read_worker_tokens(a.get("token-file")));
    s.farm.token = std::move(tokens.shared);
    s.farm.owner_tokens = std::move(tokens.owners);
  }
  const int files = a.has("ca") + a.has("certificate") + a.has("key");
  if (files != 0 && files != 3)
    return fail(ErrorKind::kUsage, "--ca, --certificate and --key belong together: give all three or none");
  if (files == 3) {
    KILN_TRY(s.farm.tls, TlsContext::load(tls_files(a)));
    KILN_TRY(const TlsIdentity own, load_identity(tls_files(a), static_cast<int64_t>(std::time(nullptr))));
    s.certificate_until = own.own.identity.not_after;
    s.farm.admit_strangers = true;  // for `enrol` only
    if (workers)
      return fail(ErrorKind::kUsage,
                  "--local-workers have no certificates: with TLS start kiln-worker with its own");
  }
  return s;
}

void say_where(const Service& service, const ServiceSettings& s) {
  const std::string data = std::filesystem::absolute(s.data).string();
  const std::string address = text("{}:{}", s.farm.listen_host, service.port());
  std::printf("kiln serves %s at %s%s\n", data.c_str(), address.c_str(), s.farm.tls ? " with TLS" : "");
  if (s.farm.tls) {
    std::printf(
        "workers:  kiln-worker --connect HOST:%u --ca ca.pem --certificate cert.pem --key key.pem\n"
        "jobs:     kiln submit scene.glb --server HOST:%u --ca ca.pem --certificate cert.pem --key key.pem\n",
        service.port(), service.port());
    const size_t revoked = s.farm.tls->revocations().serials;
    std::printf("revoked:  %zu certificates, by the lists %s and beside --ca\n", revoked,
                (s.authority / "revoked").c_str());
  } else {
    const std::string worker_token =
        s.farm.token.empty() ? data + "/worker.token" : "the file of --token-file";
    std::printf(
        "workers:  kiln-worker --connect %s --token-file %s\n"
        "jobs:     kiln submit scene.glb --server %s --token-file %s/submit.token --wait\n",
        address.c_str(), worker_token.c_str(), address.c_str(), data.c_str());
  }
  std::fflush(stdout);
}

int run(const Arguments& a, const BakeSettings&) {
  log_setup("kiln serve", a.has("verbose") ? LogLevel::kInfo : LogLevel::kWarning,
            a.get("log") == "json" ? LogFormat::kJson : LogFormat::kText);
  ::umask(0077);  // the queue, scenes and results are for this user alone, whoever writes them
  auto settings = read_settings(a);
  if (!settings) return report_error(settings.error());
  // Before any thread starts, so that all inherit the mask: only this thread waits for signals.
  sigset_t signals;
  ::sigemptyset(&signals);
  ::sigaddset(&signals, SIGTERM);
  ::sigaddset(&signals, SIGINT);
  ::pthread_sigmask(SIG_BLOCK, &signals, nullptr);
  auto service = Service::start(*settings);
  if (!service) return report_error(service.error());
  const auto web = start_web(a, **service, *settings);
  if (!web) return report_error(web.error());
  say_where(**service, *settings);
  if (*web) {
    std::printf("look at:  http://%s:%u/   (metrics: /metrics)\n",
                parse_listen_address(a.get("http"))->first.c_str(), (*web)->port());
    std::fflush(stdout);
  }
  int signal = 0;
  ::sigwait(&signals, &signal);
  std::fprintf(stderr, "kiln: stopping; unfinished jobs continue at the next start\n");
  if (!(*service)->stop(kStopPatience)) std::_Exit(0);  // a long stage of a job: durable state is safe
  return 0;
}

}  // namespace

Command serve_command() {
  return {
      "serve",
      "Run the coordinator as a service: a job queue, many workers, results stored until they are fetched",
      "kiln serve --data /srv/kiln --local-workers 1\n"
      "  kiln serve --data /srv/kiln --http 127.0.0.1:7801\n"
      "  kiln serve --data /srv/kiln --listen 0.0.0.0:7800 --ca farm/ca.pem --certificate farm/cert.pem "
      "--key "
      "farm/key.pem",
      {{"--data", "DIR", "folder of the queue, created if needed", true},
       {"--listen", "HOST:PORT", "address for workers and users [127.0.0.1:7800]"},
       {"--http", "HOST:PORT",
        "status page, /metrics, /livez, /readyz and JSON; read-only; off loopback needs --insecure-plain"},
       {"--http-token-file", "FILE",
        "bearer token that --http asks for, not the workers' [on loopback none, else DIR/web.token, created "
        "if "
        "needed]"},
       {"--token-file", "FILE",
        "workers' token, without TLS; a further line NAME TOKEN is NAME's own [DIR/worker.token, created if "
        "needed]"},
       {"--ca", "FILE", "TLS: the farm's authority"},
       {"--certificate", "FILE", "TLS: this coordinator's certificate"},
       {"--key", "FILE", "TLS: its key"},
       {"--authority", "FOLDER",
        "TLS: folder made by `kiln cert ca`; signs machines that present a join token, and what `kiln cert "
        "revoke` writes there counts at once, as does a file `revoked` beside --ca [DIR/authority]"},
       {"--insecure-plain", "", "listen off loopback without TLS: scenes and tokens are sent in the clear"},
       {"--local-workers", "N", "worker processes on this machine [0]"},
       {"--threads", "T", "threads per local worker [processors divided among them]"},
       {"--active-jobs", "N", "jobs baked at the same time [4]"},
       {"--prepare-memory", "MIB",
        "most memory to import a job's scene and lay out its lightmap; more fails the job [a quarter of the "
        "machine's, at least 1024]"},
       {"--prepare-time", "S", "most seconds for the same [3600]"},
       {"--audit-first", "N",
        "answers of a new worker that a second worker checks; later ones are checked at random; 0: trust "
        "workers [10]"},
       {"--keep-days", "D", "days to keep ended jobs and their results [30]"},
       {"--scrub", "MIB",
        "MiB a second at which all that is stored is read once a week and held against its digest; 0: never "
        "[8]"},
       {"--log", "FORMAT", "text or json [text]"},
       {"--verbose", "", "log normal events too, not only problems"}},
      false,
      run};
}

}  // namespace kiln
