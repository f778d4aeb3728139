#include "coordinator/service/fields.h"

#include <algorithm>
#include <limits>

#include "common/base/format.h"

namespace kiln {
namespace {

using Kind = JsonValue::Kind;
constexpr uint64_t kMaxId = uint64_t{1} << 62;

tl::unexpected<Error> wrong(const char* name, const std::string& what) {
  return fail(ErrorKind::kInvalidInput, text("'{}' {}", name, what));
}

Expected<int64_t> whole_number(const JsonValue& value, const char* name, int64_t least, int64_t most) {
  const auto range = [&] { return text("must be a whole number from {} to {}", least, most); };
  if (value.kind != Kind::kNumber || !value.is_whole ||
      value.whole > static_cast<uint64_t>(std::numeric_limits<int64_t>::max()))
    return wrong(name, range());
  const auto size = static_cast<int64_t>(value.whole);
  const int64_t number = value.negative ? -size : size;
  if (number < least || number > most) return wrong(name, range());
  return number;
}

}  // namespace

Status only_fields(const JsonValue& document, std::initializer_list<const char*> names) {
  if (document.kind != Kind::kObject) return fail(ErrorKind::kInvalidInput, "an object is expected");
  for (const auto& [key, value] : document.members)
    if (std::none_of(names.begin(), names.end(), [&](const char* name) { return key == name; }))
      return fail(ErrorKind::kInvalidInput, text("unknown member '{}'", key.substr(0, 64)));
  return {};
}

Expected<std::string> text_field(const JsonValue& document, const char* name, size_t most_bytes,
                                 std::optional<std::string> fallback) {
  const JsonValue* value = document.find(name);
  if (!value) {
    if (fallback) return *fallback;
    return wrong(name, "is missing");
  }
  if (value->kind != Kind::kText) return wrong(name, "must be a string");
  if (value->text.size() > most_bytes)
    return wrong(name, text("has {} bytes: {} are allowed", value->text.size(), most_bytes));
  return value->text;
}

Expected<int64_t> number_field(const JsonValue& document, const char* name, int64_t least, int64_t most,
                               std::optional<int64_t> fallback) {
  const JsonValue* value = document.find(name);
  if (value) return whole_number(*value, name, least, most);
  if (fallback) return *fallback;
  return wrong(name, "is missing");
}

Expected<Digest> digest_field(const JsonValue& document, const char* name) {
  KILN_TRY(const std::string hex, text_field(document, name, 64));
  const auto digest = Digest::from_hex(hex);
  if (!digest) return wrong(name, "must be a SHA-256: 64 hex digits");
  return *digest;
}

Expected<std::vector<uint64_t>> ids_field(const JsonValue& document, const char* name, size_t most) {
  std::vector<uint64_t> ids;
  const JsonValue* value = document.find(name);
  if (!value) return ids;
  if (value->kind != Kind::kList) return wrong(name, "must be a list of numbers");
  if (value->items.size() > most)
    return wrong(name, text("has {} elements: {} are allowed", value->items.size(), most));
  for (const JsonValue& item : value->items) {
    KILN_TRY(const int64_t id, whole_number(item, name, 1, static_cast<int64_t>(kMaxId)));
    ids.push_back(static_cast<uint64_t>(id));
  }
  return ids;
}

}  // namespace kiln
