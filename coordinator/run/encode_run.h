// Encodes textures again from the masters of a finished bake, without tracing rays.
#pragma once

#include <set>

#include "coordinator/run/bake_run.h"

namespace kiln {

struct EncodeRequest {
  std::filesystem::path scene;   // the file that was baked
  std::filesystem::path from;    // output folder of the bake
  std::filesystem::path output;  // may be the same: textures are added, scene.glb is rewritten
  BakeSettings settings;         // rows with a source override report.json of `from`
};

struct EncodeReport {
  BakeSettings settings;  // the settings used
  std::vector<TextureFigures> textures;
  std::vector<OutputFile> files;
  std::set<std::string> written;       // every file but encode.json
  std::set<std::string> added_before;  // by earlier runs into the bake's own folder
  std::string unmet;                   // as in BakeReport
  std::vector<std::string> warnings;   // textures coarser than --max-encode-error auto allows
  double seconds = 0;                  // spent on textures
};

// Rebuilds the atlas from the scene and the bake's settings, reads the masters, and writes textures and the
// files that name them. Errors (kInvalidInput): no report or masters in `from`; a scene or layout other than
// the one baked, detected by charts.json, map sizes and chart ownership of texels.
Expected<EncodeReport> run_encode(const EncodeRequest& request,
                                  const std::function<void(const BakeProgress&)>& progress);

// Text of encode.json.
std::string encode_json(const EncodeReport& report);

}  // namespace kiln
