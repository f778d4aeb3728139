// Writes a prepared scene made in code as a .glb, so that whole bakes can be tested on it.
#pragma once

#include <filesystem>

#include "common/scene/scene.h"

namespace kiln::test {

// Meshes, instances, metallic-roughness factors with emission, punctual lights. No textures, no environment.
void write_scene_glb(const Scene& scene, const std::filesystem::path& path);

// A room of a few hundred texels with a box, a twin instance, a lamp, an emissive panel and a window.
Scene small_room();

}  // namespace kiln::test
