// The client side of the service, one request at a time.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "common/base/hash.h"
#include "common/base/json.h"

namespace kiln {

struct ClientOptions {
  std::string server = "127.0.0.1:7800";  // host:port
  std::string token;
  std::filesystem::path ca, certificate, key;  // all or none
  std::optional<Digest>
      join;          // SHA-256 of the authority, from a join token: for `enrol`, without a certificate
  std::string user;  // as stated; a certificate's name takes precedence
};

// The given options, else the environment: KILN_SERVER, KILN_TOKEN or KILN_TOKEN_FILE, KILN_CA,
// KILN_CERTIFICATE, KILN_KEY. Empty strings count as not given. Errors (kUsage) name what is missing.
struct GivenOptions {
  std::string server, token_file, ca, certificate, key;
};
Expected<ClientOptions> client_options(const GivenOptions& given);

class ServiceClient {
 public:
  // Bytes done and total.
  using Progress = std::function<void(uint64_t done, uint64_t size)>;

  // Fails (kUnavailable) when nobody answers, (kUsage) when the coordinator refuses, with its reason.
  static Expected<std::unique_ptr<ServiceClient>> connect(const ClientOptions& options);
  virtual ~ServiceClient() = default;

  virtual const std::string& role() const = 0;  // "read", "submit", "admin"
  // The reply's document, or the coordinator's error. Reconnects and repeats the request for half a minute if
  // the connection is lost: every verb of the service is idempotent.
  virtual Expected<std::string> call(const std::string& verb, const std::string& document) = 0;
  // Uploads a file under its digest; resumes after the last received byte if the connection is lost.
  virtual Status upload(const std::filesystem::path& file, const Digest& digest, uint64_t size,
                        const Progress& progress) = 0;
  // Downloads a result into a file, which appears complete with the right digest or not at all. Resumes from
  // a .part file of an earlier attempt.
  struct Wanted {
    uint64_t job = 0;
    std::string path;
    Digest digest;
    uint64_t size = 0;
  };
  virtual Status download(const Wanted& wanted, const std::filesystem::path& file,
                          const Progress& progress) = 0;
};

}  // namespace kiln
