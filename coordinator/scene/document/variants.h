// KHR_materials_variants: a file's other sets of materials.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/base/status.h"

namespace kiln {

// The names of a glTF root's variants, in its order; "" for one without a name.
std::vector<std::string> variant_names(const nlohmann::json& root);

// For messages: the names in quotes; of many the first ones, of long ones none.
std::string listed_variants(const std::vector<std::string>& names);

// Gives every primitive the material that the variant has for it; primitives without one keep theirs.
// `names`: the root's. Errors (kInvalidInput): no such variant, mappings without a list of variants or a
// material.
Status choose_variant(nlohmann::json& root, const std::vector<std::string>& names, const std::string& variant,
                      const std::string& file);

}  // namespace kiln
