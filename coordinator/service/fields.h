// Members of a document from outside: present, of the right type, in range. Errors (kInvalidInput)
// name the member.
#pragma once

#include <initializer_list>
#include <optional>
#include <string>
#include <vector>

#include "common/base/hash.h"
#include "common/base/json.h"

namespace kiln {

// Fails unless it is an object with only these members.
Status only_fields(const JsonValue& document, std::initializer_list<const char*> names);

// Without a fallback the member is required.
Expected<std::string> text_field(const JsonValue& document, const char* name, size_t most_bytes,
                                 std::optional<std::string> fallback = std::nullopt);
Expected<int64_t> number_field(const JsonValue& document, const char* name, int64_t least, int64_t most,
                               std::optional<int64_t> fallback = std::nullopt);
Expected<Digest> digest_field(const JsonValue& document, const char* name);
// Positive whole numbers; absent: none.
Expected<std::vector<uint64_t>> ids_field(const JsonValue& document, const char* name, size_t most);

}  // namespace kiln
