#include "coordinator/viewer/served_files.h"

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <vector>

#include "common/base/format.h"

namespace kiln {
namespace {

struct Descriptor {
  int fd = -1;
  ~Descriptor() {
    if (fd >= 0) ::close(fd);
  }
};

// Whether a path component may name a file we serve.
bool is_plain_name(std::string_view name) {
  if (name.empty() || name[0] == '.') return false;
  return std::none_of(name.begin(), name.end(), [](char c) {
    const auto byte = static_cast<unsigned char>(c);
    return byte < 0x20 || byte == 0x7f || c == '\\';
  });
}

}  // namespace

ServedFile::~ServedFile() {
  ::close(descriptor_);
}

size_t ServedFile::read(uint64_t offset, char* to, size_t size) const {
  const ssize_t got = ::pread(descriptor_, to, size, static_cast<off_t>(offset));
  return got > 0 ? static_cast<size_t>(got) : 0;
}

Expected<std::shared_ptr<const ServedFile>> open_below(const std::filesystem::path& folder,
                                                       std::string_view path) {
  const auto refuse = [](std::string why) { return fail(ErrorKind::kInvalidInput, std::move(why)); };
  std::vector<std::string> names;
  for (size_t at = 0; at <= path.size();) {
    const size_t end = std::min(path.find('/', at), path.size());
    names.emplace_back(path.substr(at, end - at));
    at = end + 1;
    if (!is_plain_name(names.back())) return refuse("this is not the path of a file served here");
  }
  Descriptor at{::open(folder.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC)};
  if (at.fd < 0) return refuse(text("the folder {} no longer exists", folder.string()));
  for (size_t i = 0; i < names.size(); ++i) {
    const int kind = i + 1 < names.size() ? O_DIRECTORY : O_NONBLOCK;  // do not block on a pipe
    const int next = ::openat(at.fd, names[i].c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC | kind);
    if (next < 0)
      return refuse(errno == ELOOP    ? text("'{}' is a symbolic link, which is not followed", names[i])
                    : errno == EACCES ? text("'{}' may not be read", names[i])
                                      : text("there is no '{}'", path));
    ::close(at.fd);
    at.fd = next;
  }
  struct stat status {};
  if (::fstat(at.fd, &status) != 0 || !S_ISREG(status.st_mode))
    return refuse(text("'{}' is not a file", path));
  const int fd = at.fd;
  at.fd = -1;
  return std::make_shared<const ServedFile>(fd, static_cast<uint64_t>(status.st_size));
}

const char* mime_type_of(std::string_view path) {
  static constexpr std::pair<std::string_view, const char*> kTypes[] = {
      {".html", "text/html; charset=utf-8"},
      {".js", "text/javascript; charset=utf-8"},
      {".mjs", "text/javascript; charset=utf-8"},
      {".css", "text/css; charset=utf-8"},
      {".glsl", "text/plain; charset=utf-8"},
      {".md", "text/plain; charset=utf-8"},
      {".json", "application/json"},
      {".wasm", "application/wasm"},
      {".glb", "model/gltf-binary"},
      {".gltf", "model/gltf+json"},
      {".png", "image/png"},
      {".jpg", "image/jpeg"},
      {".svg", "image/svg+xml"},
      {".ktx2", "image/ktx2"},
      {".dds", "image/vnd.ms-dds"},
      {".exr", "image/x-exr"},
      {".hdr", "image/vnd.radiance"}};
  for (const auto& [ending, type] : kTypes)
    if (path.ends_with(ending)) return type;
  return "application/octet-stream";
}

}  // namespace kiln
