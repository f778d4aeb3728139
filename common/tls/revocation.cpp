#include "common/tls/revocation.h"

#include <sys/stat.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/log.h"

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

RevocationLists::RevocationLists(const std::vector<std::filesystem::path>& files) {
  for (const std::filesystem::path& path : files) {
    const bool known = std::any_of(files_.begin(), files_.end(), [&](const File& file) {
      return file.path.lexically_normal() == path.lexically_normal();
    });
    if (known) continue;
    files_.emplace_back();
    files_.back().path = path;
  }
}

Status RevocationLists::read(File& file) const {
  auto bytes = read_file(file.path, kMaxListBytes);
  file.again = !bytes;  // too many open files, perhaps: not the list's fault, so it need not change
  if (!bytes)
    return fail(ErrorKind::kIo,
                text("the list of revoked certificates cannot be read: {}", bytes.error().message));
  auto serials = parse_revoked({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!serials)
    return fail(ErrorKind::kInvalidInput,
                text("the list of revoked certificates {}: {}", file.path.string(), serials.error().message));
  if (!std::includes(serials->begin(), serials->end(), file.serials.begin(), file.serials.end()))
    log_warning(
        text("serials have gone from the list of revoked certificates {}: they stay revoked until this "
             "program is started anew",
             file.path.string()));
  serials_.insert(serials->begin(), serials->end());
  file.serials = std::move(*serials);
  file.read = true;
  return {};
}

void RevocationLists::refresh(File& file) const {
  struct stat now {};
  Stamp stamp;
  const int code = ::stat(file.path.c_str(), &now) == 0 ? 0 : errno;
  if (code == 0)
    stamp = {now.st_ino,         static_cast<uint64_t>(now.st_size),
             now.st_mtim.tv_sec, now.st_mtim.tv_nsec,
             now.st_ctim.tv_sec, now.st_ctim.tv_nsec};
  if (stamp == file.seen && code == file.code && !file.again) return;
  file.seen = stamp;
  file.code = code;
  file.again = false;
  Status good;
  if (code == 0)
    good = read(file);
  else if (code != ENOENT || file.read)
    good = fail(ErrorKind::kIo, text("the list of revoked certificates {} cannot be read: {}",
                                     file.path.string(), std::strerror(code)));
  const std::string before = std::exchange(file.failure, good ? "" : good.error().message);
  if (good || file.failure == before) return;
  log_error(text("{}; {} until it is mended", file.failure,
                 file.read ? "its last good state counts" : "nobody is let in"));
}

Expected<bool> RevocationLists::contains(const std::string& serial) const {
  const std::lock_guard lock(mutex_);
  for (File& file : files_) refresh(file);
  if (serials_.count(serial)) return true;
  for (const File& file : files_)
    if (!file.failure.empty() && !file.read) return fail(ErrorKind::kIo, file.failure);
  return false;
}

RevocationLists::Extent RevocationLists::extent() const {
  const std::lock_guard lock(mutex_);
  Extent extent;
  for (File& file : files_) {
    refresh(file);
    extent.files += file.read;
  }
  extent.serials = serials_.size();
  return extent;
}

}  // namespace kiln
