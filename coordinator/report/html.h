// Parts shared by the HTML pages.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "coordinator/bake/plan/objects.h"

namespace kiln {

std::string escape(std::string_view s);
// A PNG embedded in the page.
std::string embedded(std::span<const std::byte> png, std::string_view caption);
// Everything up to and including the title in the body.
std::string page_head(const std::string& title);
// A table of the objects with the most texels, and the total of the others.
std::string objects_table_html(const std::vector<ObjectPlan>& objects);

// Indices of objects by descending texel count, ties by instance.
std::vector<size_t> by_texels(const std::vector<ObjectPlan>& objects);

}  // namespace kiln
