// Textures again from the masters of a finished bake: no ray is traced.
#pragma once

#include <set>

#include "coordinator/run/bake_run.h"

namespace kiln {

struct EncodeRequest {
  std::filesystem::path scene;   // the file that was baked
  std::filesystem::path from;    // output folder of the bake
  std::filesystem::path output;  // may be the same: textures are added, scene.glb is written again
  BakeSettings settings;         // rows with a source override what report.json of `from` says
};

struct EncodeReport {
  BakeSettings settings;  // as used
  std::vector<TextureFigures> textures;
  std::vector<OutputFile> files;
  std::set<std::string> written;       // every file but encode.json
  std::set<std::string> added_before;  // by earlier runs into the bake's own folder
  std::string unmet;                   // as BakeReport's
  double seconds = 0;                  // of the textures
};

// Builds the atlas again from the scene and the settings of the bake, reads the masters, and makes textures
// and the files that name them. Errors (kInvalidInput): no report or masters in `from`; another scene or
// layout than was baked, found by charts.json, the size of the maps and the texels that charts own.
Expected<EncodeReport> run_encode(const EncodeRequest& request,
                                  const std::function<void(const BakeProgress&)>& progress);

// Text of encode.json.
std::string encode_json(const EncodeReport& report);

}  // namespace kiln
