// ROOM: glTF files that carry the lightmap, or name the probes. docs/gltf.md describes them.
#pragma once

#include "common/base/status.h"
#include "coordinator/output/context/context.h"

namespace kiln {

// Each writes its file into the folder and returns its name, or no name if the file is not requested.
Expected<std::vector<std::string>> write_gltf(const OutputContext& context);            // scene.glb
Expected<std::vector<std::string>> write_gltf_instanced(const OutputContext& context);  // scene_instanced.glb
Expected<std::vector<std::string>> write_gltf_unlit(const OutputContext& context);      // scene_unlit.glb

// scene.glb of a bake of probes alone: the input file as one file, with KILN_probes and without what an
// earlier bake said of lightmaps. Lamps stay. Reads neither atlas nor lightmap.
Expected<std::vector<std::string>> write_gltf_of_probes(const OutputContext& context);

}  // namespace kiln
