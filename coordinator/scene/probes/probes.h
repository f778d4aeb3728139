// Where the probes of a bake are: volumes asked for, bricks, and what each place is found to be.
#pragma once

#include <filesystem>
#include <functional>

#include "common/base/status.h"
#include "common/probes/volume.h"
#include "common/scene/scene.h"

namespace kiln {

// Reads the file of --probes (docs/probes.md): {"version": 1, "volumes": [{"name", "min", "max", "spacing",
// "max_spacing", "visibility"}]}. Errors (kInvalidInput) name the file, the volume and the member.
Expected<std::vector<ProbeBox>> read_probe_file(const std::filesystem::path& path);

// The box around all geometry, in which probes begin and end half a spacing off the outermost surfaces.
ProbeBox box_around(const Scene& scene, double spacing, double max_spacing);

struct ProbeLayout {
  std::vector<ProbeVolume> volumes;
  // By probe. `place` is where light is gathered; `grid` the corner of its cells.
  std::vector<Vec3> grid, place;
  std::vector<ProbeState> state;
  std::vector<float> validity;  // share of directions that do not meet a back face
  std::vector<float> reach;     // metres; distances beyond do not matter to any query
  std::vector<Vec3> exit;       // of inactive ones, a point in front of the nearest surface around them
  std::vector<uint8_t> has_exit;
  std::vector<std::string> notes;
  size_t size() const { return place.size(); }
  size_t active() const;
};

struct ProbeLimits {
  uint64_t most = 100000;    // --max-probes
  bool may_coarsen = false;  // --probes auto: solve for the spacing instead of failing, and centre the bricks
  bool visibility = false;   // --probe-visibility on: of every volume
  // Asked with the number of probes before their places are found, which takes longer than counting them.
  std::function<Status(uint64_t)> accept;
};

// Lays out all volumes and finds the state of every probe. With `may_coarsen`, spacings grow by the least
// power of 2^(1/4) with which there are at most `most` probes. Errors (kInvalidInput): too many probes, a
// volume that no geometry is in or near, a volume whose probes are all inside geometry.
Expected<ProbeLayout> lay_out_probes(const Scene& scene, std::vector<ProbeBox> boxes,
                                     const ProbeLimits& limits);

// For every inactive probe the active ones that may stand in for it, with weights that add up to 1: of the 26
// around it those that see the point where it leaves the geometry it is in, by the inverse square of their
// distance; where none does, those around that were filled before, for as many rounds as it takes.
struct ProbeSource {
  uint32_t probe;
  float weight;
};
std::vector<std::vector<ProbeSource>> sources_of_inactive(const Scene& scene, const ProbeLayout& layout);

}  // namespace kiln
