#include "coordinator/scene/import/context.h"

#include <algorithm>

#include "common/base/format.h"

namespace kiln {

tl::unexpected<Error> ImportContext::bad(const std::string& what) const {
  return fail(ErrorKind::kInvalidInput, text("{}: {}", document.path.string(), what));
}

void add_note(ImportNotes& notes, ImportNote::Kind kind, std::string what) {
  notes.push_back({kind, std::move(what)});
}

std::string element(const char* kind, size_t index, const std::string& name) {
  return name.empty() ? text("{} {}", kind, index) : text("{} {} '{}'", kind, index, name);
}

std::string Finding::list(const char* one, const char* many) const {
  constexpr size_t kShown = 4;
  std::string out = text("{} {}: ", names_.size(), names_.size() == 1 ? one : many);
  for (size_t i = 0; i < std::min(kShown, names_.size()); ++i) out += (i ? ", " : "") + names_[i];
  if (names_.size() > kShown) out += ", ...";
  return out;
}

}  // namespace kiln
