// Triangle meshes that Draco packed, for KHR_draco_mesh_compression. The only user of libdraco.
#pragma once

#include <cstdint>
#include <functional>
#include <span>
#include <vector>

#include "common/base/bytes.h"
#include "common/base/status.h"

namespace kiln {

// An attribute as the file wants it.
struct DracoRequest {
  uint32_t id = 0;          // unique id in the packed mesh
  int component_type = 0;   // of the accessor: 5120 to 5126
  uint32_t components = 0;  // 1 to 4
};

struct DracoMesh {
  uint32_t vertices = 0;
  std::vector<uint32_t> indices;  // three a triangle, each below `vertices`
  std::vector<Bytes> attributes;  // as requested, tightly packed, `vertices` elements each
};

// Asks for memory before it is taken; a refusal ends the decoding and is what it returns.
using TakeMemory = std::function<Status(uint64_t bytes)>;

// Any bytes are safe. Errors are clauses: no Draco mesh of bitstream 2.2, damaged, an attribute that is not
// there or is no such one, a refusal of `take`.
Expected<DracoMesh> unpack_draco(std::span<const std::byte> packed, const std::vector<DracoRequest>& requests,
                                 const TakeMemory& take);

}  // namespace kiln
