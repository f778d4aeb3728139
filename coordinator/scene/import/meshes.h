// Converts primitives to meshes: one Mesh for each glTF (mesh, primitive) that the scene uses.
#pragma once

#include <vector>

#include "coordinator/scene/import/context.h"

namespace kiln {

struct PrimitiveRequest {
  uint32_t mesh = 0, primitive = 0;
  bool keep_uv0 = false;  // a texture reads it; uv[1] is for the lightmap and always kept
};

struct PrimitiveResult {
  Mesh mesh;                      // may have no triangles, see the counts
  size_t flat_triangles = 0;      // left out
  size_t repeated_triangles = 0;  // left out
  size_t file_triangles = 0;      // in the file
  size_t repaired_normals = 0;
  bool generated_normals = false;
  bool not_triangles = false;  // points or lines
  bool missing_uv0 = false;    // requested but not in the file
};

// Reads them in parallel; returns the error of the first failing request.
Expected<std::vector<PrimitiveResult>> read_primitives(const ImportContext& context,
                                                       const std::vector<PrimitiveRequest>& requests);

// One note per kind of finding.
void note_primitives(const ImportContext& context, const std::vector<PrimitiveRequest>& requests,
                     const std::vector<PrimitiveResult>& results, ImportNotes& notes);

}  // namespace kiln
