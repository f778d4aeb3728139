// Reads a record's properties by type and remembers which were never read.
#pragma once

#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/scene.h"

namespace kiln {

class RecordReader {
 public:
  explicit RecordReader(const Record& record) : record_(record) {}

  float number(std::string_view name, float fallback) {
    const Property* p = take(name);
    return p && !p->numbers.empty() ? static_cast<float>(p->numbers[0]) : fallback;
  }
  Vec3 vec3(std::string_view name, Vec3 fallback) {
    const Property* p = take(name);
    if (!p || p->numbers.size() < 3) return fallback;
    return Vec3(p->numbers[0], p->numbers[1], p->numbers[2]);
  }
  Vec4 vec4(std::string_view name, Vec4 fallback) {
    const Property* p = take(name);
    if (!p || p->numbers.size() < 4) return fallback;
    return Vec4(p->numbers[0], p->numbers[1], p->numbers[2], p->numbers[3]);
  }
  std::string word(std::string_view name, std::string_view fallback) {
    const Property* p = take(name);
    return p && !p->word.empty() ? p->word : std::string(fallback);
  }
  std::vector<double> numbers(std::string_view name) {
    const Property* p = take(name);
    return p ? p->numbers : std::vector<double>();
  }
  TextureUse texture(std::string_view name) {
    const Property* p = take(name);
    return p ? p->texture : TextureUse{};
  }

  // Warnings about unread properties, one sentence each.
  std::vector<std::string> unread() const {
    std::vector<std::string> out;
    for (const Property& p : record_.properties)
      if (!read_.count(p.name))
        out.push_back(record_.type + " '" + record_.name + "': property '" + p.name + "' is not used");
    return out;
  }

 private:
  const Property* take(std::string_view name) {
    read_.insert(std::string(name));
    return record_.find(name);
  }
  const Record& record_;
  std::set<std::string> read_;
};

}  // namespace kiln
