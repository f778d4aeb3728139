// A finished bake as the report's renderer needs it: the scene and atlas laid out again, and the published
// maps.
#pragma once

#include "coordinator/run/bake_run.h"

namespace kiln::test {

struct Published {
  ImportResult imported;
  Atlas atlas;
  Lightmap map;  // E and classes
};

Expected<Published> read_published(const std::filesystem::path& scene, const BakeSettings& settings,
                                   const std::filesystem::path& folder);

}  // namespace kiln::test
