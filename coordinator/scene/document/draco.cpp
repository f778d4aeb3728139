// The bitstream states how many triangles, vertices and attributes it has, and the library allocates them
// before it reads any: its decoders are stopped here before they do, so that the budget of the import
// decides.
#include "coordinator/scene/document/draco.h"

#include <draco/compression/mesh/mesh_edgebreaker_decoder.h>
#include <draco/compression/mesh/mesh_sequential_decoder.h>
#include <draco/core/decoder_buffer.h>

#include <cstring>
#include <memory>

#include "common/base/format.h"

namespace kiln {
namespace {

// What the library keeps for one while it decodes: corners, tables of edges and of visits; measured.
constexpr uint64_t kTriangle = 160, kVertex = 64;
constexpr uint64_t kCopies = 3;  // of attribute values: portable, dequantised, ours

tl::unexpected<Error> bad(std::string what) {
  return fail(ErrorKind::kInvalidInput, std::move(what));
}

// Draco's bitstream 2.2: seven bits a byte, the lowest first. A copy of the buffer reads ahead.
bool peek_varint(draco::DecoderBuffer& buffer, uint64_t& value) {
  value = 0;
  for (uint32_t shift = 0; shift < 35; shift += 7) {
    uint8_t group;
    if (!buffer.Decode(&group)) return false;
    value |= uint64_t{group & 127u} << shift;
    if (group < 128) return true;
  }
  return false;
}

template <class Decoder, bool vertices_first>
class Bounded final : public Decoder {
 public:
  explicit Bounded(const TakeMemory& take) : take_(take) {}
  const Status& refused() const { return refused_; }

 private:
  // Edgebreaker states vertices and triangles, the sequential method the other way round.
  bool DecodeConnectivity() override {
    draco::DecoderBuffer ahead = *this->buffer();
    uint64_t vertices, triangles;
    if (!peek_varint(ahead, vertices_first ? vertices : triangles) ||
        !peek_varint(ahead, vertices_first ? triangles : vertices))
      return false;
    return allows(triangles * kTriangle + vertices * kVertex) && Decoder::DecodeConnectivity();
  }
  // All attributes are known by now, and none of their values.
  bool DecodeAllAttributes() override {
    const draco::PointCloud& cloud = *this->point_cloud();
    uint64_t bytes = 0;
    for (int32_t a = 0; a < cloud.num_attributes(); ++a) {
      const draco::PointAttribute& attribute = *cloud.attribute(a);
      const int width = draco::DataTypeLength(attribute.data_type());
      if (width <= 0) return false;
      bytes += uint64_t{static_cast<uint32_t>(width)} * static_cast<uint8_t>(attribute.num_components());
    }
    return allows(kCopies * bytes * cloud.num_points()) && Decoder::DecodeAllAttributes();
  }
  bool allows(uint64_t bytes) {
    refused_ = take_(bytes);
    return refused_.has_value();
  }

  const TakeMemory& take_;
  Status refused_;
};

template <class BoundedDecoder>
Expected<std::unique_ptr<draco::Mesh>> run(std::span<const std::byte> packed, const TakeMemory& take) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(packed.data()), packed.size());
  auto mesh = std::make_unique<draco::Mesh>();
  BoundedDecoder decoder(take);
  const draco::Status status = decoder.Decode(draco::DecoderOptions(), &buffer, mesh.get());
  KILN_TRY_STATUS(decoder.refused());
  if (!status.ok()) return bad(text("its Draco data does not decode: {}", status.error_msg()));
  return mesh;
}

Expected<std::unique_ptr<draco::Mesh>> decode(std::span<const std::byte> packed, const TakeMemory& take) {
  draco::DecoderBuffer buffer;
  buffer.Init(reinterpret_cast<const char*>(packed.data()), packed.size());
  draco::DracoHeader header;
  if (!draco::PointCloudDecoder::DecodeHeader(&buffer, &header).ok()) return bad("its data is not Draco's");
  if (header.version_major != 2 || header.version_minor != 2)
    return bad(text("its Draco data is of bitstream {}.{}; the extension and Kiln know 2.2",
                    header.version_major, header.version_minor));
  if (header.encoder_type != draco::TRIANGULAR_MESH) return bad("its Draco data is not a mesh of triangles");
  try {
    if (header.encoder_method == draco::MESH_EDGEBREAKER_ENCODING)
      return run<Bounded<draco::MeshEdgebreakerDecoder, true>>(packed, take);
    if (header.encoder_method == draco::MESH_SEQUENTIAL_ENCODING)
      return run<Bounded<draco::MeshSequentialDecoder, false>>(packed, take);
  } catch (const std::exception&) {  // bad_alloc, length_error: it throws none of its own
    return bad("its Draco data does not decode: it asks for more than there is");
  }
  return bad(text("its Draco data is of the unknown method {}", header.encoder_method));
}

template <class T>
bool convert(const draco::PointAttribute& attribute, uint32_t vertices, uint32_t components, Bytes& out) {
  if (!attribute.is_mapping_identity() && attribute.indices_map_size() < vertices) return false;
  out.resize(size_t{vertices} * components * sizeof(T));
  T element[4];
  for (uint32_t v = 0; v < vertices; ++v) {
    const draco::AttributeValueIndex value = attribute.mapped_index(draco::PointIndex(v));
    if (value.value() >= attribute.size()) return false;
    if (!attribute.ConvertValue<T>(value, static_cast<int8_t>(components), element)) return false;
    std::memcpy(&out[size_t{v} * components * sizeof(T)], element, components * sizeof(T));
  }
  return true;
}

bool convert(const draco::PointAttribute& attribute, const DracoRequest& request, uint32_t vertices,
             Bytes& out) {
  switch (request.component_type) {
    case 5120:
      return convert<int8_t>(attribute, vertices, request.components, out);
    case 5121:
      return convert<uint8_t>(attribute, vertices, request.components, out);
    case 5122:
      return convert<int16_t>(attribute, vertices, request.components, out);
    case 5123:
      return convert<uint16_t>(attribute, vertices, request.components, out);
    case 5125:
      return convert<uint32_t>(attribute, vertices, request.components, out);
    default:
      return convert<float>(attribute, vertices, request.components, out);
  }
}

}  // namespace

Expected<DracoMesh> unpack_draco(std::span<const std::byte> packed, const std::vector<DracoRequest>& requests,
                                 const TakeMemory& take) {
  KILN_TRY(const std::unique_ptr<draco::Mesh> mesh, decode(packed, take));
  DracoMesh out;
  out.vertices = mesh->num_points();
  for (uint32_t f = 0; f < mesh->num_faces(); ++f)
    for (const draco::PointIndex& corner : mesh->face(draco::FaceIndex(f))) {
      if (corner.value() >= out.vertices)
        return bad(text("triangle {} of its Draco data names vertex {}, there are {}", f, corner.value(),
                        out.vertices));
      out.indices.push_back(corner.value());
    }
  for (const DracoRequest& request : requests) {
    const draco::PointAttribute* attribute = mesh->GetAttributeByUniqueId(request.id);
    if (!attribute) return bad(text("its Draco data has no attribute {}", request.id));
    if (static_cast<uint8_t>(attribute->num_components()) != request.components)
      return bad(text("attribute {} of its Draco data has {} components, its accessor {}", request.id,
                      static_cast<uint8_t>(attribute->num_components()), request.components));
    Bytes& bytes = out.attributes.emplace_back();
    if (!convert(*attribute, request, out.vertices, bytes))
      return bad(text("attribute {} of its Draco data does not fit its accessor's component type {}",
                      request.id, request.component_type));
  }
  return out;
}

}  // namespace kiln
