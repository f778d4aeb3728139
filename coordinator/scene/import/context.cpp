#include "coordinator/scene/import/context.h"

#include <algorithm>

#include "common/base/format.h"

namespace kiln {

tl::unexpected<Error> ImportContext::bad(const std::string& what) const {
  constexpr size_t kMost = 4000;  // a word of the file may be of any length
  return fail(ErrorKind::kInvalidInput, text("{}: {}{}", document.path.string(), what.substr(0, kMost),
                                             what.size() > kMost ? "..." : ""));
}

void add_note(ImportNotes& notes, ImportNote::Kind kind, std::string what) {
  notes.push_back({kind, std::move(what)});
}

std::string element(const char* kind, size_t index, const std::string& name) {
  constexpr size_t kShown = 120;
  if (name.empty()) return text("{} {}", kind, index);
  if (name.size() <= kShown) return text("{} {} '{}'", kind, index, name);
  size_t end = kShown;
  while (end > 0 && (static_cast<uint8_t>(name[end]) & 0xc0) == 0x80) --end;  // whole characters
  return text("{} {} '{}...'", kind, index, name.substr(0, end));
}

std::string Finding::list(const char* one, const char* many) const {
  constexpr size_t kShown = 4;
  std::string out = text("{} {}: ", names_.size(), names_.size() == 1 ? one : many);
  for (size_t i = 0; i < std::min(kShown, names_.size()); ++i) out += (i ? ", " : "") + names_[i];
  if (names_.size() > kShown) out += ", ...";
  return out;
}

}  // namespace kiln
