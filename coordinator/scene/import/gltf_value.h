// A JSON value from "extensions" or "extras", interpreted by the reader of that extension.
#pragma once

#include <map>
#include <optional>
#include <string>
#include <vector>

namespace kiln {

struct GltfValue {
  enum class Kind { kNone, kNumber, kFlag, kWord, kArray, kObject } kind = Kind::kNone;
  double number = 0;  // of a flag: 0 or 1
  std::string word;
  std::vector<GltfValue> items;
  std::map<std::string, GltfValue> members;

  const GltfValue* find(const std::string& name) const {
    const auto it = members.find(name);
    return it == members.end() ? nullptr : &it->second;
  }
  // The member as a number, or `otherwise` when it is absent or something else.
  double number_or(const std::string& name, double otherwise) const {
    const GltfValue* v = find(name);
    return v && v->kind == Kind::kNumber ? v->number : otherwise;
  }
  // The member as an index; -1 when it is absent, negative, fractional or something else.
  int index(const std::string& name) const {
    const double n = number_or(name, -1);
    return n >= 0 && n < 2147483648.0 && n == static_cast<int>(n) ? static_cast<int>(n) : -1;
  }
  // An array of exactly `count` numbers (0: any count), else nullopt.
  std::optional<std::vector<double>> numbers(size_t count) const {
    if (kind != Kind::kArray || (count != 0 && items.size() != count)) return std::nullopt;
    std::vector<double> out;
    for (const GltfValue& item : items) {
      if (item.kind != Kind::kNumber) return std::nullopt;
      out.push_back(item.number);
    }
    return out;
  }
  std::optional<std::vector<double>> numbers(const std::string& name, size_t count) const {
    const GltfValue* v = find(name);
    return v ? v->numbers(count) : std::nullopt;
  }
};

// By name; a present name may have an empty value (KHR_materials_unlit).
using GltfExtensions = std::map<std::string, GltfValue>;

}  // namespace kiln
