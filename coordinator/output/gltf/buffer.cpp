#include "coordinator/output/gltf/buffer.h"

#include <cmath>
#include <cstring>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string_view>

#include "common/base/format.h"
#include "coordinator/scene/document/gltf_component.h"
#include "coordinator/scene/document/uri.h"

namespace kiln {
namespace {

using Json = nlohmann::json;

size_t components_of(const std::string& type) {
  static const std::pair<const char*, size_t> kTypes[] = {
      {"SCALAR", 1}, {"VEC2", 2}, {"VEC3", 3}, {"VEC4", 4}};
  for (const auto& [name, count] : kTypes)
    if (type == name) return count;
  return 0;
}

double component(const std::byte* at, int type) {
  const auto read = [at]<class T>(T value) {
    std::memcpy(&value, at, sizeof value);
    return static_cast<double>(value);
  };
  switch (type) {
    case 5120:
      return read(int8_t{});
    case 5121:
      return read(uint8_t{});
    case 5122:
      return read(int16_t{});
    case 5123:
      return read(uint16_t{});
    case 5125:
      return read(uint32_t{});
    default:
      return read(float{});
  }
}

void put_component(std::byte* at, int type, double value) {
  const auto write = [at](auto v) { std::memcpy(at, &v, sizeof v); };
  const auto whole = std::llround(value);  // a blend of representable values stays in range
  switch (type) {
    case 5120:
      return write(static_cast<int8_t>(whole));
    case 5121:
      return write(static_cast<uint8_t>(whole));
    case 5122:
      return write(static_cast<int16_t>(whole));
    case 5123:
      return write(static_cast<uint16_t>(whole));
    case 5125:
      return write(static_cast<uint32_t>(whole));
    default:
      return write(static_cast<float>(value));
  }
}

VertexBlend nearest_of(const VertexBlend& b) {
  size_t most = 0;
  for (size_t k = 1; k < 3; ++k)
    if (b.weight[k] > b.weight[most]) most = k;
  return {{b.vertex[most], 0, 0}, {1, 0, 0}};
}

// Writes one element of `size` bytes; `unit`: normalises the first three float components.
void blend(const VertexBlend& b, const std::byte* elements, size_t size, int type, bool unit,
           std::byte* out) {
  if (b.weight[1] == 0 && b.weight[2] == 0) {
    std::memcpy(out, elements + b.vertex[0] * size, size);
    return;
  }
  const size_t width = component_bytes(type), count = size / width;
  double value[4] = {};
  for (size_t c = 0; c < std::min<size_t>(count, 4); ++c)
    for (size_t k = 0; k < 3; ++k)
      if (b.weight[k] != 0)
        value[c] += double{b.weight[k]} * component(elements + b.vertex[k] * size + c * width, type);
  if (unit && type == 5126 && count >= 3) {
    const double norm = std::sqrt(value[0] * value[0] + value[1] * value[1] + value[2] * value[2]);
    for (size_t c = 0; norm > 0 && c < 3; ++c) value[c] /= norm;
  }
  for (size_t c = 0; c < std::min<size_t>(count, 4); ++c) put_component(out + c * width, type, value[c]);
}

// glTF 2.0, 3.7.2.1: POSITION needs bounds of the stored values.
Json bounds(std::span<const std::byte> elements, size_t stride, size_t count, int type, size_t components,
            bool upper) {
  Json out = Json::array();
  for (size_t c = 0; c < components; ++c) {
    double bound = component(elements.data() + c * component_bytes(type), type);
    for (size_t i = 1; i < count; ++i) {
      const double value = component(elements.data() + i * stride + c * component_bytes(type), type);
      bound = upper ? std::max(bound, value) : std::min(bound, value);
    }
    if (type == 5126)
      out.push_back(bound);
    else
      out.push_back(static_cast<int64_t>(bound));
  }
  return out;
}

const char* mime_type(const Bytes& image) {
  const auto has = [&](size_t at, std::string_view magic) {
    return image.size() >= at + magic.size() &&
           std::memcmp(image.data() + at, magic.data(), magic.size()) == 0;
  };
  return has(1, "PNG")        ? "image/png"
         : has(8, "WEBP")     ? "image/webp"
         : has(4, "ftypavif") ? "image/avif"
                              : "image/jpeg";
}

tl::unexpected<Error> lost(std::string what) {
  return fail(ErrorKind::kInternal, "scene.glb: " + std::move(what));
}

}  // namespace

Expected<GltfBuffer> GltfBuffer::merge(Json& doc, const GltfDocument& document) {
  GltfBuffer b;
  std::vector<size_t> begin;
  std::map<const Bytes*, size_t> known;  // buffers of one file share its bytes
  for (const auto& bytes : document.buffers) {
    const auto [at, is_new] = known.try_emplace(bytes.get(), (b.bytes_.size() + 15) & ~size_t{15});
    begin.push_back(at->second);
    if (!is_new) continue;
    b.bytes_.resize(at->second);
    b.bytes_.insert(b.bytes_.end(), bytes->begin(), bytes->end());
  }
  if (doc.contains("bufferViews"))
    for (Json& view : doc["bufferViews"]) {
      const size_t buffer = view.value("buffer", size_t{0});
      if (buffer >= begin.size()) return lost("a buffer view names a buffer that does not exist");
      view["byteOffset"] = begin[buffer] + view.value("byteOffset", size_t{0});
      view["buffer"] = 0;
    }
  return b;
}

Status GltfBuffer::embed_images(Json& doc, const std::filesystem::path& folder) {
  if (!doc.contains("images")) return {};
  for (Json& image : doc["images"]) {
    if (!image.contains("uri") || !image["uri"].is_string()) continue;
    const std::string uri = image["uri"];
    if (uri.rfind("data:", 0) == 0) continue;
    const auto bytes = read_uri(folder, uri);  // refuses paths that leave the scene's folder
    if (!bytes) continue;                      // import has already warned of it
    image.erase("uri");
    image["bufferView"] = add_view(doc, *bytes, 0);
    image["mimeType"] = mime_type(*bytes);
  }
  return {};
}

Expected<GltfBuffer::Elements> GltfBuffer::read_accessor(const Json& doc, size_t index) const {
  if (!doc.contains("accessors") || index >= doc["accessors"].size())
    return lost("an accessor does not exist");
  const Json& a = doc["accessors"][index];
  Elements e;
  e.size = component_bytes(a.value("componentType", 0)) * components_of(a.value("type", ""));
  e.count = a.value("count", size_t{0});
  if (e.size == 0 || e.count > bytes_.size()) return lost(text("accessor {} has an unknown layout", index));
  e.bytes.assign(e.count * e.size, std::byte{0});
  const auto read = [&](size_t view_index, size_t offset, size_t count, size_t size, size_t stride,
                        std::byte* out) -> Status {
    const Json& view = doc["bufferViews"].at(view_index);
    const size_t begin = view.value("byteOffset", size_t{0}) + offset;
    const size_t step = stride ? stride : view.value("byteStride", size);
    if (count == 0) return {};
    if (begin > bytes_.size() || (count - 1) > (bytes_.size() - begin) / std::max<size_t>(step, 1) ||
        begin + (count - 1) * step + size > bytes_.size())
      return lost(text("accessor {} reads past its buffer", index));
    for (size_t i = 0; i < count; ++i) std::memcpy(out + i * size, bytes_.data() + begin + i * step, size);
    return {};
  };
  if (a.contains("bufferView"))
    KILN_TRY_STATUS(
        read(a["bufferView"], a.value("byteOffset", size_t{0}), e.count, e.size, 0, e.bytes.data()));
  if (a.contains("sparse")) {
    const Json& sparse = a["sparse"];
    const size_t count = sparse.value("count", size_t{0}),
                 width = component_bytes(sparse["indices"].value("componentType", 0));
    if (width == 0 || count > e.count) return lost(text("accessor {} has a wrong sparse part", index));
    std::vector<std::byte> at(count * width), values(count * e.size);
    KILN_TRY_STATUS(read(sparse["indices"]["bufferView"], sparse["indices"].value("byteOffset", size_t{0}),
                         count, width, width, at.data()));
    KILN_TRY_STATUS(read(sparse["values"]["bufferView"], sparse["values"].value("byteOffset", size_t{0}),
                         count, e.size, e.size, values.data()));
    for (size_t i = 0; i < count; ++i) {
      uint32_t target = 0;
      std::memcpy(&target, at.data() + i * width, width);
      if (target >= e.count) return lost(text("accessor {} has a wrong sparse index", index));
      std::memcpy(e.bytes.data() + target * e.size, values.data() + i * e.size, e.size);
    }
  }
  return e;
}

Expected<std::vector<uint32_t>> GltfBuffer::triangle_corners(const Json& doc, const Json& primitive) const {
  std::vector<uint32_t> order;
  if (primitive.contains("indices")) {
    KILN_TRY(const Elements e, read_accessor(doc, primitive["indices"]));
    order.assign(e.count, 0);
    for (size_t i = 0; i < e.count; ++i)
      std::memcpy(&order[i], e.bytes.data() + i * e.size, std::min<size_t>(4, e.size));
  } else {
    const size_t position = primitive["attributes"].value("POSITION", size_t{0});
    const size_t count = doc["accessors"].at(position).value("count", size_t{0});
    for (size_t i = 0; i < count; ++i) order.push_back(static_cast<uint32_t>(i));
  }
  const int mode = primitive.value("mode", 4);
  if (mode == 4) return order;
  std::vector<uint32_t> corners;  // glTF 2.0, 3.7.2.1: strips and fans
  for (size_t i = 0; i + 2 < order.size(); ++i) {
    if (mode == 5)
      corners.insert(corners.end(), {order[i], order[i + 1 + i % 2], order[i + 2 - i % 2]});
    else
      corners.insert(corners.end(), {order[i + 1], order[i + 2], order[0]});
  }
  return corners;
}

size_t GltfBuffer::add_view(Json& doc, std::span<const std::byte> bytes, int target, size_t stride) {
  bytes_.resize((bytes_.size() + 3) & ~size_t{3});
  Json view = {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", bytes.size()}};
  if (target) view["target"] = target;
  if (stride) view["byteStride"] = stride;
  bytes_.insert(bytes_.end(), bytes.begin(), bytes.end());
  doc["bufferViews"].push_back(std::move(view));
  return doc["bufferViews"].size() - 1;
}

Expected<Json> GltfBuffer::gather_attributes(Json& doc, const Json& attributes,
                                             const std::vector<VertexBlend>& source) {
  Json out = Json::object();
  for (const auto& [name, accessor] : attributes.items()) {
    if (name == "TEXCOORD_1") continue;
    KILN_TRY(const Elements e, read_accessor(doc, accessor));
    const size_t stride = (e.size + 3) & ~size_t{3};  // vertex data is aligned to 4
    Bytes packed(source.size() * stride, std::byte{0});
    const int type = doc["accessors"][accessor.get<size_t>()].value("componentType", 0);
    const bool by_nearest = name.rfind("JOINTS", 0) == 0 || name.rfind("WEIGHTS", 0) == 0;
    const bool unit = name == "NORMAL" || name == "TANGENT";
    for (size_t v = 0; v < source.size(); ++v) {
      for (const uint32_t vertex : source[v].vertex)
        if (vertex >= e.count) return lost(text("attribute {} is too short", name));
      const VertexBlend from = by_nearest ? nearest_of(source[v]) : source[v];
      blend(from, e.bytes.data(), e.size, type, unit, packed.data() + v * stride);
    }
    Json made = doc["accessors"][accessor.get<size_t>()];
    made.erase("sparse");
    made.erase("byteOffset");
    made.erase("min");
    made.erase("max");
    made["count"] = source.size();
    made["bufferView"] = add_view(doc, packed, 34962, stride);
    out[name] = doc["accessors"].size();
    doc["accessors"].push_back(std::move(made));
  }
  return out;
}

int GltfBuffer::add_indices(Json& doc, const std::vector<uint32_t>& indices) {
  const size_t view = add_view(doc, bytes_of(indices), 34963);
  doc["accessors"].push_back(
      {{"bufferView", view}, {"componentType", 5125}, {"count", indices.size()}, {"type", "SCALAR"}});
  return static_cast<int>(doc["accessors"].size() - 1);
}

int GltfBuffer::add_texcoords(Json& doc, const std::vector<Vec2>& uv) {
  const size_t view = add_view(doc, bytes_of(uv), 34962, sizeof(Vec2));
  doc["accessors"].push_back(
      {{"bufferView", view}, {"componentType", 5126}, {"count", uv.size()}, {"type", "VEC2"}});
  return static_cast<int>(doc["accessors"].size() - 1);
}

int GltfBuffer::add_scalars(Json& doc, const std::vector<float>& values) {
  const size_t view = add_view(doc, bytes_of(values), 34962, sizeof(float));
  doc["accessors"].push_back(
      {{"bufferView", view}, {"componentType", 5126}, {"count", values.size()}, {"type", "SCALAR"}});
  return static_cast<int>(doc["accessors"].size() - 1);
}

size_t GltfBuffer::add_page_texture(Json& doc, std::span<const std::byte> png, const std::string& name) {
  doc["images"].push_back({{"bufferView", add_view(doc, png, 0)}, {"mimeType", "image/png"}, {"name", name}});
  doc["samplers"].push_back({{"magFilter", 9729}, {"minFilter", 9729}, {"wrapS", 33071}, {"wrapT", 33071}});
  doc["textures"].push_back(
      {{"source", doc["images"].size() - 1}, {"sampler", doc["samplers"].size() - 1}, {"name", name}});
  return doc["textures"].size() - 1;
}

Status GltfBuffer::state_bounds(Json& doc) const {
  std::set<size_t> positions;
  for (const Json& mesh : doc.value("meshes", Json::array()))
    for (const Json& primitive : mesh["primitives"])
      if (primitive["attributes"].contains("POSITION"))
        positions.insert(primitive["attributes"]["POSITION"].get<size_t>());
  for (const size_t accessor : positions) {
    KILN_TRY(const Elements e, read_accessor(doc, accessor));
    Json& a = doc["accessors"][accessor];
    const int type = a.value("componentType", 0);
    if (e.count == 0) continue;
    const size_t components = e.size / component_bytes(type);
    a["min"] = bounds(e.bytes, e.size, e.count, type, components, false);
    a["max"] = bounds(e.bytes, e.size, e.count, type, components, true);
  }
  return {};
}

void GltfBuffer::keep_views(Json& doc, const std::vector<bool>& used) {
  Bytes kept;
  Json views = Json::array();
  for (size_t v = 0; v < used.size(); ++v) {
    if (!used[v]) continue;
    Json view = doc["bufferViews"][v];
    const size_t begin = view.value("byteOffset", size_t{0}), length = view.value("byteLength", size_t{0});
    kept.resize((kept.size() + 15) & ~size_t{15});  // components are aligned relative to the original buffer
    view["byteOffset"] = kept.size();
    if (begin <= bytes_.size() && length <= bytes_.size() - begin)
      kept.insert(kept.end(), bytes_.begin() + static_cast<ptrdiff_t>(begin),
                  bytes_.begin() + static_cast<ptrdiff_t>(begin + length));
    views.push_back(std::move(view));
  }
  bytes_ = std::move(kept);
  if (views.empty())
    doc.erase("bufferViews");
  else
    doc["bufferViews"] = std::move(views);
}

Bytes GltfBuffer::take(Json& doc) {
  bytes_.resize((bytes_.size() + 3) & ~size_t{3});
  doc["buffers"] = Json::array({{{"byteLength", bytes_.size()}}});
  return std::move(bytes_);
}

}  // namespace kiln
