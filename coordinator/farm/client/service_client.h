// A person's program talking to the service, one question at a time.
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
      join;          // SHA-256 of the authority, of a join token: for `enrol`, before there is a certificate
  std::string user;  // stated; a certificate's name counts before it
};

// What was given, else the environment: KILN_SERVER, KILN_TOKEN or KILN_TOKEN_FILE, KILN_CA,
// KILN_CERTIFICATE, KILN_KEY. Empty texts are not given. Errors (kUsage) say what is missing.
struct GivenOptions {
  std::string server, token_file, ca, certificate, key;
};
Expected<ClientOptions> client_options(const GivenOptions& given);

class ServiceClient {
 public:
  // Bytes done and of all.
  using Progress = std::function<void(uint64_t done, uint64_t size)>;

  // Fails (kUnavailable) when nobody answers, (kUsage) when the coordinator refuses, with its words.
  static Expected<std::unique_ptr<ServiceClient>> connect(const ClientOptions& options);
  virtual ~ServiceClient() = default;

  virtual const std::string& role() const = 0;  // "read", "submit", "admin"
  // The reply's document, or the coordinator's error. A connection that is lost is made anew and the question
  // asked again, for half a minute: every verb of the service may be asked twice.
  virtual Expected<std::string> call(const std::string& verb, const std::string& document) = 0;
  // A file under its digest; goes on after the last byte that came when the connection is lost.
  virtual Status upload(const std::filesystem::path& file, const Digest& digest, uint64_t size,
                        const Progress& progress) = 0;
  // A result of a job into a file, which appears complete, with the right digest, or not at all. Goes on with
  // what an earlier try left beside it (.part).
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
