// The probes beside a lightmap, as scene.glb names them.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/math/vec.h"

namespace kiln {

// A volume as Bevy reads it: the file, and the transform of its entity.
struct PublishedBevyVolume {
  std::string uri;
  DVec3 translation{0.0}, scale{1.0};
};

// World axes, metres.
struct PublishedProbeVolume {
  std::string name;
  std::optional<uint32_t> node;  // of the scene's file, that asked for it
  DVec3 low{0.0}, high{0.0};
  double spacing = 1;  // the finest
  uint32_t levels = 1;
  bool visibility = false;
  std::optional<PublishedBevyVolume> bevy;
};

struct PublishedProbes {
  uint64_t probes = 0;
  std::vector<PublishedProbeVolume> volumes;  // in the order of probes.json
};

}  // namespace kiln
