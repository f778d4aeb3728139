// Accessors to plain arrays. Every offset, length and stride is checked against its buffer before a byte
// is read or an array is made.
#pragma once

#include <cstdint>
#include <vector>

#include "coordinator/scene/import/context.h"

namespace kiln {

// An accessor as floats: values[i * components + c]. Normalised integers are mapped to [0, 1] or [-1, 1]
// (glTF 2.0, section 3.11), other integers keep their value; sparse values are applied.
struct FloatArray {
  uint32_t components = 0;
  std::vector<float> values;
  size_t size() const { return components ? values.size() / components : 0; }
};

Expected<FloatArray> read_floats(const ImportContext& context, int accessor);

// An accessor of unsigned integer scalars: vertex indices.
Expected<std::vector<uint32_t>> read_indices(const ImportContext& context, int accessor);

// The bytes of a buffer view (an embedded image).
Expected<std::span<const std::byte>> view_bytes(const ImportContext& context, int64_t view);

}  // namespace kiln
