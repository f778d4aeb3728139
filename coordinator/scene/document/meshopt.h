// Data that EXT_meshopt_compression packed: github.com/KhronosGroup/glTF, extensions/2.0/Vendor/
// EXT_meshopt_compression, appendices A (bitstreams) and B (filters). Version 0 of the attribute codec and 1
// of the index codecs, which that extension names; KHR_meshopt_compression's attribute codec of version 1 is
// not read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

#include "common/base/status.h"

namespace kiln {

enum class MeshoptMode { kAttributes, kTriangles, kIndices };
enum class MeshoptFilter { kNone, kOctahedral, kQuaternion, kExponential };

struct MeshoptLayout {
  MeshoptMode mode = MeshoptMode::kAttributes;
  MeshoptFilter filter = MeshoptFilter::kNone;
  size_t count = 0;   // elements; of triangles and indices: indices
  size_t stride = 0;  // bytes of an element
};

// Whether the extension allows such a layout: the stride and count of its mode, a filter of attributes alone.
// The error is a clause about the view ("its stride is 3: ...").
Status check_meshopt(const MeshoptLayout& layout);

// The most elements of a layout that passed check_meshopt which `bytes` of packed data can hold.
size_t most_meshopt_elements(const MeshoptLayout& layout, size_t bytes);

// Unpacks into `out`, of count x stride bytes, for a layout that passed check_meshopt. Any bytes are safe;
// the error is a clause that says where they stop to make sense. Indices are not held against any number of
// vertices.
Status unpack_meshopt(const MeshoptLayout& layout, std::span<const std::byte> packed,
                      std::span<std::byte> out);

}  // namespace kiln
