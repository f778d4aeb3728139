// Levels of detail (MSFT_lod) and proxies (extras.kiln.proxy): selects the nodes to bake and those only
// drawn.
#pragma once

#include <vector>

#include "coordinator/scene/display/display.h"
#include "coordinator/scene/import/nodes.h"

namespace kiln {

// A node below one level of a set.
struct LevelNode {
  PlacedNode at;
  uint32_t set = 0, level = 0;
};

struct Levels {
  std::vector<PlacedNode> standing;  // every node of the scene except lower levels and proxies: the source of
                                     // its lights and cameras
  std::vector<DisplaySet> sets;      // without `sources`
  // Baked nodes by group; group 0 belongs to no set. A proxy that is placed in the scene is one group for all
  // sets that name it.
  std::vector<std::vector<PlacedNode>> baked;
  std::vector<bool> is_proxy;          // by group
  std::vector<uint32_t> group_of_set;  // by set
  std::vector<LevelNode> shown;
};

// Every node of the baked scene, parents before children, in the file's order. A level replaces its node: it
// has the node's parent, or is unplaced and gets the node's position. So does an unplaced proxy. Errors name
// the nodes: an index or name that does not exist, a level or proxy of two nodes, one of itself, sets within
// sets, EXT_mesh_gpu_instancing below a level.
Expected<Levels> read_levels(const ImportContext& context, ImportNotes& notes);

}  // namespace kiln
