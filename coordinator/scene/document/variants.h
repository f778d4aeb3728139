// KHR_materials_variants: a file's other sets of materials.
#pragma once

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "common/base/status.h"

namespace kiln {

// The names of a glTF root's variants, in its order; empty if it has none. Errors (kInvalidInput): names that
// are no strings.
Expected<std::vector<std::string>> variant_names(const nlohmann::json& root, const std::string& file);

// For messages: the names in quotes, the first ones of many.
std::string listed_variants(const std::vector<std::string>& names);

// Gives every primitive the material that the variant has for it; primitives without one keep theirs. Errors
// (kInvalidInput): no such variant, mappings without a list of variants or a material.
Status choose_variant(nlohmann::json& root, const std::string& variant, const std::string& file);

}  // namespace kiln
