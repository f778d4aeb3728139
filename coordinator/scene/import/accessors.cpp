#include "coordinator/scene/import/accessors.h"

#include <algorithm>
#include <cmath>

#include "common/base/format.h"
#include "coordinator/scene/document/gltf_component.h"

namespace kiln {
namespace {

template <class T>
T load(const std::byte* p) {
  T value;
  std::memcpy(&value, p, sizeof value);  // accessors need not be aligned
  return value;
}

float load_float(const std::byte* p, int type, bool normalized) {
  switch (type) {
    case 5120:
      return normalized ? std::max(load<int8_t>(p) / 127.0f, -1.0f) : load<int8_t>(p);
    case 5121:
      return normalized ? load<uint8_t>(p) / 255.0f : load<uint8_t>(p);
    case 5122:
      return normalized ? std::max(load<int16_t>(p) / 32767.0f, -1.0f) : load<int16_t>(p);
    case 5123:
      return normalized ? load<uint16_t>(p) / 65535.0f : load<uint16_t>(p);
    case 5125:
      return static_cast<float>(normalized ? load<uint32_t>(p) / 4294967295.0
                                           : static_cast<double>(load<uint32_t>(p)));
    default:
      return load<float>(p);
  }
}

uint32_t load_index(const std::byte* p, int type) {
  return type == 5121 ? load<uint8_t>(p) : type == 5123 ? load<uint16_t>(p) : load<uint32_t>(p);
}

bool is_index_type(int type) {
  return type == 5121 || type == 5123 || type == 5125;
}

// Reads `count` elements known to lie within a buffer.
struct Elements {
  const std::byte* data = nullptr;
  size_t stride = 0;
  const std::byte* at(size_t i) const { return data + i * stride; }
};

Expected<Elements> locate(const ImportContext& context, const std::string& who, int64_t view, int64_t offset,
                          size_t count, size_t element_bytes) {
  KILN_TRY(const std::span<const std::byte> bytes, view_bytes(context, view));
  const size_t declared = context.model.buffer_views[static_cast<size_t>(view)].stride;
  const size_t stride = declared ? declared : element_bytes;
  if (stride < element_bytes)
    return context.bad(
        text("{}: byteStride {} is less than the {} bytes of an element", who, stride, element_bytes));
  const bool fits =
      offset >= 0 && static_cast<size_t>(offset) <= bytes.size() &&
      (count == 0 || (bytes.size() - static_cast<size_t>(offset) >= element_bytes &&
                      (bytes.size() - static_cast<size_t>(offset) - element_bytes) / stride >= count - 1));
  if (!fits)
    return context.bad(text(
        "{}: {} elements of {} bytes, {} bytes apart from byte {}, do not fit in buffer view {} of {} bytes",
        who, count, element_bytes, stride, offset, view, bytes.size()));
  return Elements{bytes.data() + offset, stride};
}

struct Source {
  const GltfAccessor* accessor;
  std::string who;
  size_t element_bytes;
};

Expected<Source> find_accessor(const ImportContext& context, int index) {
  if (index < 0 || static_cast<size_t>(index) >= context.model.accessors.size())
    return context.bad(
        text("accessor {} does not exist, there are {}", index, context.model.accessors.size()));
  const GltfAccessor& a = context.model.accessors[static_cast<size_t>(index)];
  const size_t bytes = component_bytes(a.component_type);
  if (bytes == 0)
    return context.bad(text("accessor {}: component type {} is not supported", index, a.component_type));
  if (a.components < 1 || a.components > 4)
    return context.bad(text("accessor {}: {} components where 1 to 4 are expected", index, a.components));
  if (a.count > std::numeric_limits<uint32_t>::max())
    return context.bad(text("accessor {}: {} elements are too many", index, a.count));
  return Source{&a, text("accessor {}", index), bytes * a.components};
}

// Overwrites an accessor's dense values with its sparse ones.
Status apply_sparse(const ImportContext& context, const Source& source, std::vector<float>& values) {
  const GltfAccessor& a = *source.accessor;
  const GltfAccessor::Sparse& s = *a.sparse;
  if (s.count < 0 || static_cast<size_t>(s.count) > a.count)
    return context.bad(text("{}: {} sparse values for {} elements", source.who, s.count, a.count));
  if (!is_index_type(s.index_type))
    return context.bad(text("{}: sparse index type {} is not supported", source.who, s.index_type));
  const size_t count = static_cast<size_t>(s.count);
  KILN_TRY(const Elements indices, locate(context, source.who + ": sparse indices", s.index_view,
                                          s.index_offset, count, component_bytes(s.index_type)));
  KILN_TRY(const Elements put, locate(context, source.who + ": sparse values", s.value_view, s.value_offset,
                                      count, source.element_bytes));
  const size_t component = component_bytes(a.component_type);
  for (size_t i = 0; i < count; ++i) {
    const size_t target = load_index(indices.at(i), s.index_type);
    if (target >= a.count)
      return context.bad(
          text("{}: sparse index {} is {}, there are {} elements", source.who, i, target, a.count));
    for (uint32_t c = 0; c < a.components; ++c)
      values[target * a.components + c] =
          load_float(put.at(i) + c * component, a.component_type, a.normalized);
  }
  return {};
}

}  // namespace

Expected<std::span<const std::byte>> view_bytes(const ImportContext& context, int64_t index) {
  const auto& views = context.model.buffer_views;
  if (index < 0 || static_cast<size_t>(index) >= views.size())
    return context.bad(text("buffer view {} does not exist, there are {}", index, views.size()));
  const GltfBufferView& view = views[static_cast<size_t>(index)];
  const auto& buffers = context.document.buffers;
  if (view.buffer < 0 || static_cast<size_t>(view.buffer) >= buffers.size())
    return context.bad(
        text("buffer view {}: buffer {} does not exist, there are {}", index, view.buffer, buffers.size()));
  const Bytes& buffer = *buffers[static_cast<size_t>(view.buffer)];
  if (view.offset > buffer.size() || view.length > buffer.size() - view.offset)
    return context.bad(text("buffer view {}: bytes {} + {} do not fit in buffer {} of {} bytes", index,
                            view.offset, view.length, view.buffer, buffer.size()));
  return std::span<const std::byte>(buffer).subspan(view.offset, view.length);
}

Expected<FloatArray> read_floats(const ImportContext& context, int accessor) {
  KILN_TRY(const Source source, find_accessor(context, accessor));
  const GltfAccessor& a = *source.accessor;
  FloatArray out;
  out.components = a.components;
  if (a.buffer_view < 0) {
    // Zeros by the specification: nothing in the file bounds their count.
    KILN_TRY_STATUS(context.document.budget->take(a.count * a.components * sizeof(float),
                                                  "accessors without a buffer view"));
    out.values.assign(a.count * a.components, 0.0f);
  } else {
    KILN_TRY(const Elements elements, locate(context, source.who, a.buffer_view,
                                             static_cast<int64_t>(a.offset), a.count, source.element_bytes));
    const size_t component = component_bytes(a.component_type);
    out.values.resize(a.count * a.components);
    for (size_t i = 0; i < a.count; ++i)
      for (uint32_t c = 0; c < a.components; ++c)
        out.values[i * a.components + c] =
            load_float(elements.at(i) + c * component, a.component_type, a.normalized);
  }
  if (a.sparse) KILN_TRY_STATUS(apply_sparse(context, source, out.values));
  return out;
}

Expected<std::vector<uint32_t>> read_indices(const ImportContext& context, int accessor) {
  KILN_TRY(const Source source, find_accessor(context, accessor));
  const GltfAccessor& a = *source.accessor;
  if (!is_index_type(a.component_type) || a.components != 1 || a.sparse)
    return context.bad(text("{}: vertex indices are dense scalars of 8, 16 or 32 unsigned bits", source.who));
  KILN_TRY(const Elements elements, locate(context, source.who, a.buffer_view, static_cast<int64_t>(a.offset),
                                           a.count, source.element_bytes));
  std::vector<uint32_t> out(a.count);
  for (size_t i = 0; i < a.count; ++i) out[i] = load_index(elements.at(i), a.component_type);
  return out;
}

}  // namespace kiln
