// The two layouts. Each returns a finished atlas.
#pragma once

#include <span>

#include "common/atlas/atlas.h"

namespace kiln {

// TEXCOORD_1 of all instances is one atlas. Errors name the objects.
Expected<Atlas> layout_from_file(const Scene& scene, const AtlasSettings& settings);

// Charts of all instances packed at settings.texels_per_metre.
Expected<Atlas> layout_packed(const Scene& scene, const AtlasSettings& settings);
// The same without sites.
Expected<Atlas> pack_layout(const Scene& scene, const AtlasSettings& settings);

// Cuts charts where other surfaces stand on them (common/contacts) and notes the lines in atlas.contacts.
// `texel`: size in metres by instance. The error is that of settings.may_go_on.
Status cut_at_contacts(const Scene& scene, std::span<const double> texel, const AtlasSettings& settings,
                       Atlas& atlas);

// Warns that the search for contacts was given up.
void warn_of_no_contacts(Atlas& atlas);

// Assigns an empty set of charts to these instances.
void take_charts_away(const Scene& scene, std::span<const uint8_t> receives, Atlas& atlas);

// The meshes used by instances that receive light.
std::vector<uint8_t> meshes_with_texels(const Scene& scene);

// Fills instance_first_chart and sizes placements. Error: more charts than can be numbered.
Status number_placements(const Scene& scene, Atlas& atlas);

// "'name'", or "instance 3" when it has none; likewise for meshes.
std::string instance_name(const Scene& scene, size_t instance);
std::string mesh_name(const Scene& scene, size_t mesh);
// "'a', 'b' and 7 more".
std::string list_names(const std::vector<std::string>& names);

}  // namespace kiln
