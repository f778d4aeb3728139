// Pictures of a bake in the programs of docs/engines.md, from the file's first camera: kSampledWidth x
// kSampledHeight, black where nothing is. Each is what its user does: engines load the file with the modules
// of configs/engines.
#pragma once

#include "tests/viewer/compare_pictures.h"

namespace kiln::test {

// Bakes a scene with the textures that each program's preset asks for, and reads it again.
Expected<Published> bake_for_programs(const std::filesystem::path& scene, double texels_per_metre,
                                      const std::filesystem::path& folder, uint32_t samples);

// Why it cannot run here, with what to do; nothing: it can. Engines of the web: no_engines().
std::optional<std::string> no_blender();
std::optional<std::string> no_godot();
// As the program says it: "3.4.1". `engine`: a package of tests/node/engines.
std::string version_of_engine(const std::string& engine);
std::string version_of_blender();
std::string version_of_godot();

// FILE.glb of the baked folder in three, babylon or playcanvas; `exposure` and `material` as engine_shot.mjs
// has them.
CommandResult show_in_engine(const std::string& engine, const std::filesystem::path& folder,
                             const std::string& file, const std::filesystem::path& shot,
                             const std::string& exposure, const std::string& material);
// A file by Blender alone, in Cycles with one sample.
CommandResult show_in_blender(const std::filesystem::path& file, const std::filesystem::path& shot);
// What the add-on makes of a baked folder where the scene is open, likewise.
CommandResult show_in_add_on(const std::filesystem::path& scene, const std::filesystem::path& folder,
                             const std::filesystem::path& shot);
// Imported by the editor in a project of its own below `work`, shown by `driver` (GLES2, GLES3).
CommandResult show_in_godot(const std::filesystem::path& folder, const std::string& driver,
                            const std::filesystem::path& work, const std::filesystem::path& shot);

}  // namespace kiln::test
