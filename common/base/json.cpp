#include "common/base/json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/format.h"

namespace kiln {

std::string json_quote(std::string_view s) {
  std::string out = "\"";
  for (char c : s) {
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
        if (static_cast<unsigned char>(c) < 0x20)
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

}  // namespace kiln
