#include "coordinator/run/publish_folder.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstring>
#include <optional>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr const char* kHidden = ".kiln-publishing";
constexpr const char *kReport = "report.json", *kEncode = "encode.json";
constexpr uint64_t kMaxReportBytes = uint64_t{1} << 28;
constexpr size_t kMaxName = 255;

tl::unexpected<Error> io_error(std::string_view doing, const fs::path& path) {
  return fail(ErrorKind::kIo, text("cannot {} {}: {}", doing, path.string(), std::strerror(errno)));
}

class OpenFolder {
 public:
  explicit OpenFolder(const fs::path& path) : fd_(::open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)) {}
  ~OpenFolder() {
    if (fd_ >= 0) ::close(fd_);
  }
  OpenFolder(const OpenFolder&) = delete;
  OpenFolder& operator=(const OpenFolder&) = delete;
  int fd() const { return fd_; }
  // The file itself, not what a symbolic link leads to.
  bool has_file(const std::string& name) const {
    struct stat status {};
    return ::fstatat(fd_, name.c_str(), &status, AT_SYMLINK_NOFOLLOW) == 0 && S_ISREG(status.st_mode);
  }

 private:
  int fd_;
};

bool is_plain_name(std::string_view name) {
  return !name.empty() && name.size() <= kMaxName && name[0] != '.' &&
         std::none_of(name.begin(), name.end(), [](char c) {
           const auto byte = static_cast<unsigned char>(c);
           return byte < 0x20 || byte == 0x7f || c == '/' || c == '\\';
         });
}

// Nothing if there is no such regular file that could be a report.
std::optional<std::set<std::string>> files_listed_in(const OpenFolder& folder, const fs::path& path,
                                                     const char* report) {
  if (!folder.has_file(report)) return std::nullopt;
  const auto bytes = read_file(path / report, kMaxReportBytes);
  if (!bytes) return std::nullopt;
  const std::string_view json(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  const auto document = parse_json(json);
  if (!document || document->kind != JsonValue::Kind::kObject) return std::nullopt;
  return listed_files(json);
}

Expected<size_t> remove_files(const OpenFolder& folder, const fs::path& path,
                              const std::set<std::string>& names, const std::set<std::string>& spare) {
  size_t removed = 0;
  for (const std::string& name : names) {
    if (spare.count(name) || !folder.has_file(name)) continue;
    if (::unlinkat(folder.fd(), name.c_str(), 0) != 0 && errno != ENOENT)
      return io_error("remove a file of the earlier bake,", path / name);
    ++removed;
  }
  return removed;
}

Status sync_folder(const OpenFolder& folder, const fs::path& path) {
  if (::fsync(folder.fd()) != 0) return io_error("sync", path);
  return {};
}

// After a crash between an earlier bake's end and the new one's: there is no report, and the hidden folder
// knows what was to be there.
Status finish_interrupted(const fs::path& output, const fs::path& hidden) {
  const OpenFolder left(hidden), folder(output);
  if (left.fd() < 0 || folder.fd() < 0 || folder.has_file(kReport)) return {};
  for (const char* report : {kReport, kEncode})
    if (const auto names = files_listed_in(left, hidden, report))
      KILN_TRY_STATUS(remove_files(folder, output, *names, {}));
  return {};
}

}  // namespace

std::set<std::string> listed_files(std::string_view report) {
  std::set<std::string> names;
  const auto json = parse_json(report);
  if (!json || json->kind != JsonValue::Kind::kObject) return names;
  const auto add = [&](const JsonValue* name) {
    if (name && name->kind == JsonValue::Kind::kText && is_plain_name(name->text)) names.insert(name->text);
  };
  for (const char* key : {"files", "added_before"})
    if (const JsonValue* list = json->find(key); list && list->kind == JsonValue::Kind::kList)
      for (const JsonValue& name : list->items) add(&name);
  // Reports of releases without "files".
  if (const JsonValue* list = json->find("outputs"); list && list->kind == JsonValue::Kind::kList)
    for (const JsonValue& output : list->items)
      if (output.kind == JsonValue::Kind::kObject) add(output.find("file"));
  names.erase(kReport);
  names.erase(kEncode);
  return names;
}

Expected<size_t> remove_earlier_bake(const fs::path& path, const std::set<std::string>& spare) {
  const OpenFolder folder(path);
  if (folder.fd() < 0) return io_error("open", path);
  size_t removed = 0;
  std::set<std::string> reports;
  for (const char* report : {kEncode, kReport}) {
    const auto names = files_listed_in(folder, path, report);
    if (!names) continue;
    KILN_TRY(const size_t some, remove_files(folder, path, *names, spare));
    removed += some;
    reports.insert(report);
  }
  KILN_TRY_STATUS(sync_folder(folder, path));
  KILN_TRY(const size_t both, remove_files(folder, path, reports, spare));  // in the order of names
  KILN_TRY_STATUS(sync_folder(folder, path));
  return removed + both;
}

Expected<PublishFolder> PublishFolder::open(const fs::path& output) {
  const int lock = ::open(output.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC);
  if (lock < 0) return io_error("open the output folder", output);
  PublishFolder made(output, lock);
  // Where a file system has no locks there is no protection from a second process.
  if (::flock(lock, LOCK_EX | LOCK_NB) != 0 && errno == EWOULDBLOCK) {
    made.hidden_.clear();
    return fail(
        ErrorKind::kInvalidInput,
        text("another bake is publishing into {} right now: choose another folder with -o", output.string()));
  }
  std::error_code code;
  if (fs::symlink_status(made.hidden_, code).type() == fs::file_type::directory)
    KILN_TRY_STATUS(finish_interrupted(output, made.hidden_));
  fs::remove_all(made.hidden_, code);  // of a link: the link
  if (::mkdir(made.hidden_.c_str(), 0755) != 0) return io_error("make", made.hidden_);
  return made;
}

PublishFolder::PublishFolder(fs::path output, int lock)
    : output_(std::move(output)), hidden_(output_ / kHidden), lock_(lock) {}

PublishFolder::PublishFolder(PublishFolder&& other) noexcept
    : output_(std::move(other.output_)),
      hidden_(std::move(other.hidden_)),
      lock_(std::exchange(other.lock_, -1)) {}

PublishFolder::~PublishFolder() {
  if (lock_ < 0) return;
  std::error_code ignored;
  if (!hidden_.empty()) fs::remove_all(hidden_, ignored);
  ::close(lock_);
}

Expected<std::set<std::string>> PublishFolder::names() const {
  std::set<std::string> names;
  std::error_code code;
  for (fs::directory_iterator at(hidden_, code), end; !code && at != end; at.increment(code))
    names.insert(at->path().filename().string());
  if (code) return fail(ErrorKind::kIo, text("cannot list {}: {}", hidden_.string(), code.message()));
  return names;
}

Status PublishFolder::publish(const std::string& last, Earlier earlier) {
  KILN_TRY(std::set<std::string> written, names());
  if (earlier == Earlier::kRemove) {
    std::set<std::string> spare = written;
    spare.erase(kReport);
    spare.erase(kEncode);
    KILN_TRY_STATUS(remove_earlier_bake(output_, spare));
  }
  const OpenFolder folder(output_);
  written.erase(last);
  for (const std::string& name : written)
    if (::rename((hidden_ / name).c_str(), (output_ / name).c_str()) != 0)
      return io_error("rename a finished file to", output_ / name);
  KILN_TRY_STATUS(sync_folder(folder, output_));
  if (::rename((hidden_ / last).c_str(), (output_ / last).c_str()) != 0)
    return io_error("rename a finished file to", output_ / last);
  return sync_folder(folder, output_);
}

}  // namespace kiln
