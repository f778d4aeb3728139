// The files of probes: docs/probes.md.
#pragma once

#include <filesystem>
#include <span>

#include "common/probes/field.h"
#include "coordinator/output/encode/output.h"

namespace kiln {

// probes.json: volumes, bricks and conventions; probes.exr: what each probe holds, as planes, probe i at
// column i % kProbeColumns and row i / kProbeColumns; with visibility probes_irradiance.exr and
// probes_distance.exr, maps with borders in tiles, the same order.
constexpr uint32_t kProbeColumns = 64;
struct ProbeFileWish {
  bool bevy = false;  // probes_bevy.ktx2, or .N.ktx2 of volume N of several; named by probes.json
  // probes_light.ktx2 and, with visibility, probes_irradiance.ktx2, probes_distance.ktx2: shader_textures.h.
  bool textures = false;
};
Expected<std::vector<OutputFile>> write_probe_files(std::span<const ProbeVolume> volumes,
                                                    const ProbeField& field, const ProbeFileWish& wish,
                                                    const std::filesystem::path& folder);

}  // namespace kiln
