// Texels by object, one row each, before any ray is traced.
#pragma once

#include <string>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/job/settings.h"
#include "common/scene/scene.h"

namespace kiln {

struct ObjectPlan {
  std::string name, mesh, material;
  uint64_t charts = 0;
  uint64_t texels = 0;        // on its charts: the sum over all objects is AtlasStatistics::mask_texels
  uint64_t valid_texels = 0;  // to sample: the sum over all objects is TexelSites::size()
  double square_metres = 0;   // of its triangles in the world
  double texels_per_metre =
      0;              // as laid out: root of texels over square metres of surface with texels; 0: none
  double factor = 1;  // requested, see coordinator/scene/density
  bool receive = true, cast = true, reflect = true;  // as Instance
};

// By instance. `density`: as AtlasSettings::density.
std::vector<ObjectPlan> plan_objects(const Scene& scene, const Atlas& atlas,
                                     const std::vector<float>& density);

// Texels per metre of one face as it is laid out; 0: it has no texels.
double face_density(const Scene& scene, const Atlas& atlas, uint32_t instance, uint32_t face);

// Warning about a layout with more texels than were probably intended: which objects have them, their cost,
// and a density that suffices. Empty: none. `seconds`: the least time to sample all texels.
std::string advise_density(const Scene& scene, const Atlas& atlas, const AtlasSettings& settings,
                           const std::vector<ObjectPlan>& objects, double seconds);

}  // namespace kiln
