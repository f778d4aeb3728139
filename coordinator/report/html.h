// Pieces that the pages share.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/bake/plan/objects.h"

namespace kiln {

std::string escape(std::string_view s);
// A PNG inside of the page.
std::string embedded(std::span<const std::byte> png, std::string_view caption);
// Up to the title inside of the body.
std::string page_head(const std::string& title);
// The objects with the most texels, and what the others have together.
std::string objects_table_html(const std::vector<ObjectPlan>& objects);

// Indices of objects, most texels first, equals by instance.
std::vector<size_t> by_texels(const std::vector<ObjectPlan>& objects);

}  // namespace kiln
