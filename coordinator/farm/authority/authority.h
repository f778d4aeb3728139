// The folder of a farm's certificate authority. Whoever can read ca.key controls the farm.
//   ca.pem, ca.key   the authority; ca.pem goes to every machine, ca.key to none
//   issued           a line for each certificate: serial, name, roles, end
//   revoked          serials of revoked certificates (common/tls/revocation.h)
//   tokens           join tokens by their digests (tokens.h)
// Every change happens under a lock and by rename, so that a crash leaves either the old or the new state.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/tls/identity.h"

namespace kiln {

constexpr int64_t kSecondsADay = 86400;

// Creates the folder and a new authority. Fails (kUsage) if the folder already has one.
Expected<Certificate> make_authority_folder(const std::filesystem::path& dir, const std::string& name,
                                            int64_t days, int64_t now);

struct IssueWish {
  std::string name;
  std::vector<Role> roles;
  std::vector<std::string> hosts{};
  int64_t days = 365;
  bool new_name = false;  // nobody may have a certificate of this name that is good (check_new_name)
};

// Makes a key and a certificate in the folder `out`: ca.pem, cert.pem, key.pem; for a coordinator, which
// needs a host, also a copy of the list `revoked`. It expires no later than the authority.
Expected<Certificate> issue(const std::filesystem::path& dir, const IssueWish& wish,
                            const std::filesystem::path& out, int64_t now);
// Signs a machine's own request under the name it states. Returns the certificate as PEM.
Expected<std::string> sign(const std::filesystem::path& dir, const std::string& request,
                           const IssueWish& wish, int64_t now);

struct IssuedRecord {
  std::string serial, name;
  std::vector<Role> roles;
  int64_t not_after = 0;
};
Expected<std::vector<IssuedRecord>> read_issued(const std::filesystem::path& dir);
// Fails (kUsage) if a certificate of this name has neither expired nor been revoked: names decide whose jobs
// and whose votes they are, so a machine that joins by itself may not take another's.
Status check_new_name(const std::filesystem::path& dir, const std::string& name, int64_t now);

// Adds a serial to `revoked`, or those of all unexpired certificates of a name. Returns the newly revoked
// ones. Fails (kUsage) if nothing issued here matches.
Expected<std::vector<IssuedRecord>> revoke(const std::filesystem::path& dir,
                                           const std::string& serial_or_name, int64_t now);

// Held during changes of the folder, against other threads and processes.
class AuthorityLock {
 public:
  static Expected<AuthorityLock> take(const std::filesystem::path& dir);
  AuthorityLock(AuthorityLock&& other) noexcept : fd_(std::exchange(other.fd_, -1)) {}
  AuthorityLock& operator=(AuthorityLock&&) = delete;
  ~AuthorityLock();

 private:
  explicit AuthorityLock(int fd) : fd_(fd) {}
  int fd_;
};

}  // namespace kiln
