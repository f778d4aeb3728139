#include "common/base/fields.h"

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {

std::span<const std::byte> FieldReader::take(uint64_t size) {
  if (ok() && size > left_.size()) blame(text("it ends {} bytes early", size - left_.size()));
  if (!ok()) return {};
  const auto bytes = left_.first(size);
  left_ = left_.subspan(size);
  return bytes;
}

uint64_t FieldReader::take_count(uint64_t limit, size_t element_bytes) {
  KILN_CHECK(element_bytes > 0);
  uint64_t count = 0;
  if (const auto bytes = take(sizeof count); bytes.size() == sizeof count)
    std::memcpy(&count, bytes.data(), sizeof count);
  if (count > limit) blame(text("its size is {}, of {} at most", count, limit));
  if (count > left_.size() / element_bytes) blame(text("{} elements are announced and do not follow", count));
  return ok() ? count : 0;
}

uint8_t FieldReader::take_choice(uint8_t count, const char* name) {
  const auto byte = take(1);
  if (byte.empty()) return 0;
  const auto value = std::to_integer<uint8_t>(byte[0]);
  if (value >= count) blame(text("{} {} does not exist in this release", name, value));
  return ok() ? value : 0;
}

void FieldReader::blame(std::string fault) {
  KILN_CHECK(!fault.empty());
  if (fault_.empty()) fault_ = std::move(fault);
}

Status FieldReader::finish(ErrorKind kind, std::string_view what) const {
  // The struct itself counts as the first field.
  if (!ok()) return fail(kind, text("a {} is damaged at field {}: {}", what, field_ - 1, fault_));
  if (!left_.empty())
    return fail(kind, text("a {} is damaged: {} bytes follow its last field", what, left_.size()));
  return {};
}

}  // namespace kiln
