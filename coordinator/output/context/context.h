// The input of every output of a bake, and the names of the files.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/job/settings.h"
#include "common/scene/scene.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/bake/lightmap/texture_list.h"
#include "coordinator/output/context/published_probes.h"
#include "coordinator/scene/display/display.h"
#include "coordinator/scene/document/gltf_document.h"

namespace kiln {

struct OutputContext {
  const BakeSettings& settings;
  const Scene& scene;
  const Atlas& atlas;
  const GltfDocument& document;
  const Lightmap& lightmap;
  std::filesystem::path folder;
  const Display* display = nullptr;                         // null: the scene itself is drawn
  const Projection* projection = nullptr;                   // projection of `display`
  const TextureList* textures = nullptr;                    // published textures; null: none
  const std::vector<std::string>* texture_files = nullptr;  // theirs, and others of the same stage
  bool compress = true;                                     // masters: smaller files, slower to write
  const PublishedProbes* probes = nullptr;                  // in the same folder; null: none
};

// "Kiln 0.1.0".
std::string program_name();

// Units in headers of files: a scene's radiance is in the unit of its lights (docs/radiometry.md).
constexpr const char* kIrradianceUnit = "unit of the scene's radiance x steradian (lux for radiance in nit)";
constexpr const char* kRadianceUnit = "unit of the scene's radiance";

// How the basis of a bake was made from its samples: "project", "cap", "cap for hazel" (docs/bases.md), or
// "none" for a basis without functions. Written into the headers of masters and textures, and asked for by
// `kiln encode`.
std::string fit_name(const BakeSettings& settings);

// What becomes of the file's lamps in scene.glb.
struct LampChoice {
  std::string mode;  // "drop", "keep", "mark": of --lamps; "keep" where no lamp can be in the map
  std::vector<const DisplayLamp*> in_map;  // those whose direct light is, in the file's order
  bool sky = false;                        // so is the direct light of an environment
};
LampChoice choose_lamps(const OutputContext& context);

// "irradiance.exr", or "irradiance.2.exr" for page 2 of several.
std::string page_name(const std::string& stem, const std::string& extension, uint32_t page, uint32_t pages);

}  // namespace kiln
