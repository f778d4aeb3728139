// glTF to prepared scene.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/job/settings.h"
#include "common/probes/volume.h"
#include "common/scene/scene.h"
#include "coordinator/scene/density/wishes.h"
#include "coordinator/scene/display/display.h"
#include "coordinator/scene/document/gltf_document.h"

namespace kiln {

// A finding of the importer, for plan and report.
struct ImportNote {
  enum class Kind { kBaked, kApproximated, kIgnored, kWarning, kNote } kind;
  std::string what;  // one sentence naming the element
};

struct Camera {
  Mat4x3 to_world{1.0f};      // looks along -z, +y up
  float vertical_fov = 0.8f;  // radians
  std::string name;
};

struct ImportResult {
  Scene scene;
  std::vector<ImportNote> notes;
  std::vector<Camera> cameras;   // the perspective ones of the scene, in its order
  std::vector<ProbeBox> probes;  // volumes of extras.kiln.probes; not sent to workers
  DensityWishes density;         // not part of the scene: not sent to workers
  GltfDocument document;
  Display display;  // drawn but not traced
};

// Reads a scene and adds the lights and environment of the settings. Errors are kInvalidInput and name
// the file and the element; nothing unsupported that the file requires is skipped silently.
Expected<ImportResult> import_scene(const std::filesystem::path& path, const BakeSettings& settings);

}  // namespace kiln
