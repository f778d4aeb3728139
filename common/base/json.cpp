#include "common/base/json.h"

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "common/base/format.h"

namespace kiln {

std::string json_quote(std::string_view s) {
  std::string out = "\"";
  for (size_t i = 0; i < s.size(); ++i) {
    const char c = s[i];
    const auto next = static_cast<unsigned char>(i + 1 < s.size() ? s[i + 1] : 0);
    if (c == '\xc2' && next >= 0x80 && next < 0xa0) {  // C1, which a terminal obeys
      out += text("\\u{:04x}", static_cast<unsigned>(next));
      ++i;
      continue;
    }
    switch (c) {
      case '"':
        out += "\\\"";
        break;
      case '\\':
        out += "\\\\";
        break;
      case '\n':
        out += "\\n";
        break;
      case '\t':
        out += "\\t";
        break;
      case '\r':
        out += "\\r";
        break;
      default:
        if (static_cast<unsigned char>(c) < 0x20 || c == 0x7f)
          out += text("\\u{:04x}", static_cast<unsigned>(static_cast<unsigned char>(c)));
        else
          out += c;
    }
  }
  return out + "\"";
}

void JsonWriter::separate() {
  if (after_key_) {
    after_key_ = false;
    return;
  }
  if (filled_.empty()) return;
  if (filled_.back()) out_ += ',';
  filled_.back() = true;
  out_ += '\n';
  out_.append(2 * filled_.size(), ' ');
}

JsonWriter& JsonWriter::open(char bracket) {
  separate();
  out_ += bracket;
  filled_.push_back(false);
  return *this;
}

JsonWriter& JsonWriter::close(char bracket) {
  const bool filled = filled_.back();
  filled_.pop_back();
  if (filled) {
    out_ += '\n';
    out_.append(2 * filled_.size(), ' ');
  }
  out_ += bracket;
  return *this;
}

JsonWriter& JsonWriter::key(std::string_view name) {
  separate();
  out_ += json_quote(name) + ": ";
  after_key_ = true;
  return *this;
}

JsonWriter& JsonWriter::value(std::string_view s) {
  separate();
  out_ += json_quote(s);
  return *this;
}
JsonWriter& JsonWriter::value(double number) {
  separate();
  out_ += std::isfinite(number) ? text("{}", number) : "null";
  return *this;
}
JsonWriter& JsonWriter::value(uint64_t number) {
  separate();
  out_ += text("{}", number);
  return *this;
}
JsonWriter& JsonWriter::value(int64_t number) {
  separate();
  out_ += text("{}", number);
  return *this;
}
JsonWriter& JsonWriter::value(bool flag) {
  separate();
  out_ += flag ? "true" : "false";
  return *this;
}

namespace {

std::string scalar_text(const nlohmann::json& v) {
  if (v.is_string()) return v.get<std::string>();
  if (v.is_boolean()) return v.get<bool>() ? "on" : "off";
  return v.dump();
}

}  // namespace

Expected<std::vector<std::pair<std::string, std::string>>> parse_flat_json(std::string_view s) {
  const nlohmann::json doc = nlohmann::json::parse(s, nullptr, /*allow_exceptions=*/false, /*comments=*/true);
  if (doc.is_discarded()) return fail(ErrorKind::kUsage, "it is not valid JSON");
  if (!doc.is_object()) return fail(ErrorKind::kUsage, "the top level must be an object of settings");
  std::vector<std::pair<std::string, std::string>> out;
  for (const auto& [key, v] : doc.items()) {
    if (v.is_array()) {
      std::string joined;
      for (const auto& item : v) {
        if (item.is_structured() || item.is_null())
          return fail(ErrorKind::kUsage, text("'{}' must be a list of numbers or words", key));
        joined += (joined.empty() ? "" : ",") + scalar_text(item);
      }
      out.emplace_back(key, joined);
    } else if (v.is_object() || v.is_null()) {
      return fail(ErrorKind::kUsage, text("'{}' must be a number, a word or a list", key));
    } else {
      out.emplace_back(key, scalar_text(v));
    }
  }
  return out;
}

const JsonValue* JsonValue::find(std::string_view name) const {
  for (const auto& [key, value] : members)
    if (key == name) return &value;
  return nullptr;
}

namespace {

// Builds values while parsing, so that depth and count are checked before memory is allocated.
class TreeReader final : public nlohmann::json_sax<nlohmann::json> {
 public:
  static constexpr size_t kDeepest = 16, kMax = size_t{1} << 20;
  JsonValue root;
  std::string error;

  bool null() override { return add({}) != nullptr; }
  bool boolean(bool flag) override {
    JsonValue v;
    v.kind = JsonValue::Kind::kFlag;
    v.flag = flag;
    return add(std::move(v)) != nullptr;
  }
  bool number_integer(number_integer_t n) override {
    return add_whole(n < 0 ? 0 - static_cast<uint64_t>(n) : static_cast<uint64_t>(n), n < 0,
                     static_cast<double>(n));
  }
  bool number_unsigned(number_unsigned_t n) override { return add_whole(n, false, static_cast<double>(n)); }
  bool number_float(number_float_t n, const string_t&) override {
    JsonValue v;
    v.kind = JsonValue::Kind::kNumber;
    v.number = n;
    return add(std::move(v)) != nullptr;
  }
  bool string(string_t& s) override {
    JsonValue v;
    v.kind = JsonValue::Kind::kText;
    v.text = std::move(s);
    return add(std::move(v)) != nullptr;
  }
  bool binary(binary_t&) override { return false; }
  bool start_object(size_t) override { return open(JsonValue::Kind::kObject); }
  bool end_object() override { return close(); }
  bool start_array(size_t) override { return open(JsonValue::Kind::kList); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    if (!open_.back()->members.empty() && names_.back().count(name))
      return refuse(text("'{}' is there twice", name.substr(0, 64)));
    names_.back().insert(name);
    key_ = std::move(name);
    return true;
  }
  bool parse_error(size_t at, const std::string&, const nlohmann::detail::exception&) override {
    return refuse(text("it is not valid JSON at byte {}", at));
  }

 private:
  bool refuse(std::string why) {
    if (error.empty()) error = std::move(why);
    return false;
  }
  bool add_whole(uint64_t size, bool negative, double number) {
    JsonValue v;
    v.kind = JsonValue::Kind::kNumber;
    v.number = number;
    v.is_whole = true;
    v.negative = negative;
    v.whole = size;
    return add(std::move(v)) != nullptr;
  }
  JsonValue* add(JsonValue value) {
    if (++count_ > kMax) {
      refuse("it has too many values");
      return nullptr;
    }
    if (open_.empty()) {
      root = std::move(value);
      return &root;
    }
    JsonValue& parent = *open_.back();
    if (parent.kind == JsonValue::Kind::kList) return &parent.items.emplace_back(std::move(value));
    parent.members.push_back({std::move(key_), std::move(value)});
    return &parent.members.back().second;
  }
  bool open(JsonValue::Kind kind) {
    if (open_.size() == kDeepest) return refuse("it is nested too deeply");
    JsonValue v;
    v.kind = kind;
    // Pointers stay valid: a parent gets no further element before this one is closed.
    JsonValue* place = add(std::move(v));
    if (!place) return false;
    open_.push_back(place);
    names_.emplace_back();
    return true;
  }
  bool close() {
    open_.pop_back();
    names_.pop_back();
    return true;
  }
  std::vector<JsonValue*> open_;
  std::vector<std::set<std::string>> names_;
  std::string key_;
  size_t count_ = 0;
};

}  // namespace

Expected<JsonValue> parse_json(std::string_view s) {
  TreeReader reader;
  if (!nlohmann::json::sax_parse(s, &reader) || !reader.error.empty())
    return fail(ErrorKind::kInvalidInput, reader.error.empty() ? "it is not valid JSON" : reader.error);
  return std::move(reader.root);
}

}  // namespace kiln
