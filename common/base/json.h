// JSON out (streamed, keys in the order written) and flat JSON in (job files).
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/base/status.h"

namespace kiln {

// Writes indented JSON. Numbers that are not finite become null.
class JsonWriter {
 public:
  JsonWriter& begin_object() { return open('{'); }
  JsonWriter& end_object() { return close('}'); }
  JsonWriter& begin_array() { return open('['); }
  JsonWriter& end_array() { return close(']'); }
  JsonWriter& key(std::string_view name);
  JsonWriter& value(std::string_view text);
  JsonWriter& value(const char* text) { return value(std::string_view(text)); }
  JsonWriter& value(const std::string& text) { return value(std::string_view(text)); }
  JsonWriter& value(double number);
  JsonWriter& value(uint64_t number);
  JsonWriter& value(int64_t number);
  JsonWriter& value(int number) { return value(static_cast<int64_t>(number)); }
  JsonWriter& value(uint32_t number) { return value(static_cast<uint64_t>(number)); }
  JsonWriter& value(bool flag);
  template <class T>
  JsonWriter& pair(std::string_view name, const T& v) {
    key(name);
    return value(v);
  }
  std::string take() { return std::move(out_) + "\n"; }

 private:
  JsonWriter& open(char bracket);
  JsonWriter& close(char bracket);
  void separate();
  std::string out_;
  std::vector<bool> filled_;  // per open bracket: has it an element
  bool after_key_ = false;
};

std::string json_quote(std::string_view text);

// One object of scalars and arrays of scalars, as (key, text); arrays are joined by commas.
// Fails on anything deeper, naming the key.
Expected<std::vector<std::pair<std::string, std::string>>> parse_flat_json(std::string_view text);

struct JsonMember;

// A value parsed from an untrusted document.
struct JsonValue {
  enum class Kind : uint8_t { kNull, kFlag, kNumber, kText, kList, kObject };
  Kind kind = Kind::kNull;
  bool flag = false;
  double number = 0;
  // For integers: `whole` holds the magnitude exactly.
  bool is_whole = false, negative = false;
  uint64_t whole = 0;
  std::string text;
  std::vector<JsonValue> items;                        // of a list
  std::vector<JsonMember> members;                     // of an object, in their order
  const JsonValue* find(std::string_view name) const;  // nullptr: no such member
};

struct JsonMember {
  std::string first;  // the name
  JsonValue second;
};

// Fails (kInvalidInput) if the text is not JSON, nests deeper than 16, has more than 2^20 values, or repeats
// a name in an object.
Expected<JsonValue> parse_json(std::string_view text);

}  // namespace kiln
