#include "coordinator/scene/document/gltf_numbers.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/format.h"

namespace kiln {
namespace {

using nlohmann::json;

bool is_whole(const json& number) {
  if (number.is_number_unsigned()) return true;
  if (!number.is_number_float()) return false;  // a negative whole number, or no number
  const double value = number.get<double>();
  return value >= 0 && value < 0x1p53 && value == std::floor(value);
}

Status check_object(const json& object, const std::string& who, const std::filesystem::path& path) {
  for (const char* name : {"byteOffset", "byteLength", "byteStride", "count"})
    if (const auto it = object.find(name); it != object.end() && !is_whole(*it))
      return fail(ErrorKind::kInvalidInput, text("{}: {}: {} is {}, not a whole number of at least 0",
                                                 path.string(), who, name, it->dump().substr(0, 40)));
  return {};
}

}  // namespace

Status check_gltf_numbers(const json& root, const std::filesystem::path& path) {
  for (const auto& [list, one] : {std::pair{"bufferViews", "buffer view"}, {"accessors", "accessor"}}) {
    const auto found = root.find(list);
    if (found == root.end() || !found->is_array()) continue;
    for (size_t i = 0; i < found->size(); ++i) {
      const json& element = (*found)[i];
      if (!element.is_object()) continue;
      KILN_TRY_STATUS(check_object(element, text("{} {}", one, i), path));
      const auto sparse = element.find("sparse");
      if (sparse == element.end() || !sparse->is_object()) continue;
      KILN_TRY_STATUS(check_object(*sparse, text("{} {}: sparse", one, i), path));
      for (const char* part : {"indices", "values"})
        if (const auto it = sparse->find(part); it != sparse->end() && it->is_object())
          KILN_TRY_STATUS(check_object(*it, text("{} {}: sparse {}", one, i, part), path));
    }
  }
  return {};
}

}  // namespace kiln
