// Helpers to build records.
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include "common/scene/scene.h"

namespace kiln {

inline void put_numbers(Record& record, std::string name, std::vector<double> numbers) {
  record.properties.push_back({std::move(name), std::move(numbers), {}, {}});
}
inline void put_word(Record& record, std::string name, std::string word) {
  record.properties.push_back({std::move(name), {}, std::move(word), {}});
}
inline void put_texture(Record& record, std::string name, const TextureUse& use) {
  record.properties.push_back({std::move(name), {}, {}, use});
}

}  // namespace kiln
