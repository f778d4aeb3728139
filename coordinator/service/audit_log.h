// Who changed what and when: DATA/audit.jsonl, one JSON object a line, in the order of the changes.
#pragma once

#include <filesystem>
#include <mutex>
#include <string>

#include "common/base/json.h"
#include "coordinator/farm/queue/open_file.h"
#include "coordinator/service/people.h"

namespace kiln {

class AuditLog {
 public:
  // The file is created with the first line, for its owner alone (0600), and again after it was renamed away.
  explicit AuditLog(std::filesystem::path file) : file_(std::move(file)) {}
  // Appends the line, durably; a line that does not fit the disk leaves nothing behind. From any thread.
  Status append(const std::string& line);

 private:
  Status open();

  const std::filesystem::path file_;
  std::mutex mutex_;
  OpenFile open_;
};

// The line of a request that changed something. Of its document and the reply: the job, what was changed to
// what, and whom a join token made what. No secrets, no settings.
std::string audit_line(int64_t unix_ms, const Caller& caller, const std::string& verb,
                       const JsonValue& document, const std::string& reply);
// The line of a certificate that was cut off because the authority revoked it.
std::string revocation_line(int64_t unix_ms, const PeerIdentity& whose, const std::string& peer);

}  // namespace kiln
