// What engines have of a file beside the traced surface. Meshes that they draw but the bake does not trace:
// levels of detail other than the baked one, and objects with a proxy. Import finds them,
// coordinator/scene/lods gives them lightmap coordinates, encode writes them. And the nodes of lamps.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "common/scene/scene.h"
#include "common/unwrap/mesh_charts.h"

namespace kiln {

// The meshes drawn for one node, and the surface baked for it.
struct DisplaySet {
  uint32_t node = 0;              // of the file: has MSFT_lod or a proxy
  std::string name;               // of the node
  std::vector<uint32_t> sources;  // instances of the scene: the baked surface
  std::string baked;              // "level 0" or "proxy 'name'"
  double most_distance = 0;       // metres, set by the node; 0: the setting's
};

struct DisplayMesh {
  Instance place;  // `mesh` indexes Display::meshes; `material` is unused
  uint32_t set = 0, level = 0;
};

// A node whose light was imported.
struct DisplayLamp {
  uint32_t node = 0;   // of the file
  std::string name;    // of the light, else of the node
  std::string type;    // of its record
  bool direct = true;  // extras.kiln.bake is "full": its direct light is baked too
};

struct Display {
  std::vector<Mesh> meshes;
  std::vector<DisplayMesh> shown;
  std::vector<DisplaySet> sets;
  std::vector<bool>
      undrawn;  // by instance of the scene, may be shorter: true for a proxy, which engines do not draw
  std::vector<DisplayLamp> lamps;
  bool is_drawn(uint32_t instance) const { return instance >= undrawn.size() || !undrawn[instance]; }
};

// Lightmap coordinates of one display mesh: its faces are triangles or parts of triangles.
// `charts.corner_uv` is in texels of the page; charts are placements of the atlas.
struct ProjectedCharts {
  MeshCharts charts;
  std::vector<uint32_t> placement;  // by chart: index into Atlas::placements
};

// How well a display mesh fits the baked surface, over a grid of points on every face.
struct DisplayFit {
  std::string name;  // of the display node
  uint32_t level = 0;
  std::string baked;        // as DisplaySet
  double worst = 0;         // metres, from a display point to the point whose light it gets
  double mean = 0;          // metres, by area
  double worst_texels = 0;  // the worst distance in texels of the baked surface
  double shift_texels = 0;  // largest distance between the texels looked up and those of that point
  double limit = 0;         // metres allowed
  DVec3 worst_at{0};        // world position of the worst point
  uint64_t triangles = 0;   // of the mesh
  uint64_t faces = 0;       // after splitting; more than `triangles` if some were split
};

// By index of Display::shown.
struct Projection {
  std::vector<ProjectedCharts> charts;
  std::vector<DisplayFit> fits;
};

}  // namespace kiln
