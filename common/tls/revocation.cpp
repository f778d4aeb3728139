#include "common/tls/revocation.h"

#include <sys/stat.h>

#include <cerrno>
#include <cstring>

#include "common/base/files.h"
#include "common/base/format.h"

namespace kiln {
namespace {

constexpr uint64_t kMaxListBytes = 16 << 20;
constexpr size_t kMaxSerialDigits = 64;

}  // namespace

Expected<std::set<std::string>> parse_revoked(std::string_view list) {
  std::set<std::string> serials;
  for (size_t line = 1; !list.empty(); ++line) {
    const size_t end = std::min(list.find('\n'), list.size());
    std::string_view words = list.substr(0, std::min(list.find('#'), end));
    list.remove_prefix(std::min(end + 1, list.size()));
    std::string serial;
    bool good = true, ended = false;
    for (const char c : words) {
      if (c == ' ' || c == '\t' || c == '\r') {
        ended = !serial.empty();
      } else {
        const char lower = c >= 'A' && c <= 'F' ? static_cast<char>(c - 'A' + 'a') : c;
        good = good && !ended && ((lower >= '0' && lower <= '9') || (lower >= 'a' && lower <= 'f'));
        serial += lower;
      }
    }
    if (!good || serial.size() > kMaxSerialDigits)
      return fail(ErrorKind::kInvalidInput,
                  text("line {} is not a serial number in hex, as `kiln cert show` prints it", line));
    if (!serial.empty()) serials.insert(std::move(serial));
  }
  return serials;
}

Status RevocationList::refresh() const {
  struct stat now {};
  if (::stat(file_.c_str(), &now) != 0) {
    if (errno == ENOENT && read_.inode == 0) return {};
    return fail(ErrorKind::kIo,
                text("the list of revoked certificates {} cannot be read: {}; nobody is let in "
                     "until it can",
                     file_.string(), std::strerror(errno)));
  }
  const Stamp stamp{now.st_ino, static_cast<uint64_t>(now.st_size), now.st_mtim.tv_sec, now.st_mtim.tv_nsec};
  if (stamp == read_) return {};
  const auto bytes = read_file(file_, kMaxListBytes);
  if (!bytes)
    return fail(ErrorKind::kIo,
                text("the list of revoked certificates cannot be read: {}; nobody is let in until "
                     "it can",
                     bytes.error().message));
  auto serials = parse_revoked({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!serials)
    return fail(ErrorKind::kInvalidInput,
                text("the list of revoked certificates {}: {}; nobody is let in until it "
                     "is mended",
                     file_.string(), serials.error().message));
  serials_ = std::move(*serials);
  read_ = stamp;
  return {};
}

Expected<bool> RevocationList::contains(const std::string& serial) const {
  const std::lock_guard lock(mutex_);
  KILN_TRY_STATUS(refresh());
  return serials_.count(serial) != 0;
}

}  // namespace kiln
