// What the JSON of a glTF will weigh in memory once it is parsed, found without parsing it into anything.
#pragma once

#include <cstdint>
#include <string_view>

namespace kiln {

struct JsonWeight {
  uint64_t bytes = 0;     // of the structures that import makes of it; an estimate from above
  bool too_deep = false;  // nested beyond kMaxJsonDepth; nothing behind that point was read
  uint64_t bad_at = 0;    // byte at which it does not parse; 0: it does
};

// Readers of extensions and extras recurse: bounds their stack.
constexpr int kMaxJsonDepth = 128;

JsonWeight weigh_json(std::string_view source);

}  // namespace kiln
