#include "coordinator/scene/import/meshes.h"

#include <numeric>

#include "common/base/format.h"
#include "common/base/parallel.h"
#include "coordinator/scene/import/accessors.h"
#include "coordinator/scene/import/geometry.h"

namespace kiln {
namespace {

std::string primitive_name(const ImportContext& context, const PrimitiveRequest& request) {
  return text("{} primitive {}", element("mesh", request.mesh, context.model.meshes[request.mesh].name),
              request.primitive);
}

template <class V>
std::vector<V> as_vectors(const FloatArray& array) {
  std::vector<V> out(array.size());
  static_assert(sizeof(V) % sizeof(float) == 0);
  if (!out.empty()) std::memcpy(out.data(), array.values.data(), array.values.size() * sizeof(float));
  return out;
}

// Reads attributes of one primitive and checks that they belong together.
class AttributeReader {
 public:
  AttributeReader(const ImportContext& context, const GltfPrimitive& primitive, std::string who)
      : context_(context), primitive_(primitive), who_(std::move(who)) {}

  bool has(const char* name) const { return primitive_.attributes.count(name) != 0; }

  Expected<FloatArray> read(const char* name, uint32_t least, uint32_t most) const {
    auto array = read_floats(context_, primitive_.attributes.at(name));
    if (!array)
      return fail(array.error().kind, text("{} (attribute {} of {})", array.error().message, name, who_));
    if (array->components < least || array->components > most)
      return context_.bad(text("{}: attribute {} has {} components", who_, name, array->components));
    if (vertices_ && array->size() != *vertices_)
      return context_.bad(
          text("{}: attribute {} has {} elements for {} vertices", who_, name, array->size(), *vertices_));
    return array;
  }
  void set_vertices(size_t count) { vertices_ = count; }
  const std::string& who() const { return who_; }

 private:
  const ImportContext& context_;
  const GltfPrimitive& primitive_;
  std::string who_;
  std::optional<size_t> vertices_;
};

Expected<std::vector<Vec3>> read_positions(const ImportContext& context, const AttributeReader& reader) {
  KILN_TRY(const FloatArray array, reader.read("POSITION", 3, 3));
  std::vector<Vec3> positions = as_vectors<Vec3>(array);
  for (size_t i = 0; i < positions.size(); ++i)
    if (!is_finite(positions[i]))
      return context.bad(text("{}: the position of vertex {} is not finite ({}, {}, {})", reader.who(), i,
                              positions[i].x, positions[i].y, positions[i].z));
  return positions;
}

Expected<std::vector<uint32_t>> read_vertex_indices(const ImportContext& context,
                                                    const GltfPrimitive& primitive, const std::string& who,
                                                    size_t vertices) {
  std::vector<uint32_t> indices;
  if (primitive.indices < 0) {
    indices.resize(vertices);
    std::iota(indices.begin(), indices.end(), 0u);
    return indices;
  }
  auto read = read_indices(context, primitive.indices);
  if (!read) return fail(read.error().kind, text("{} (indices of {})", read.error().message, who));
  for (size_t i = 0; i < read->size(); ++i)
    if ((*read)[i] >= vertices)
      return context.bad(
          text("{}: index {} is {}, out of range of its {} vertices", who, i, (*read)[i], vertices));
  return std::move(*read);
}

Expected<std::vector<Vec4>> read_colors(const AttributeReader& reader) {
  KILN_TRY(const FloatArray array, reader.read("COLOR_0", 3, 4));
  std::vector<Vec4> colors(array.size(), Vec4(1));
  bool white = true;
  for (size_t i = 0; i < colors.size(); ++i)
    for (uint32_t c = 0; c < array.components; ++c) {
      const float value = array.values[i * array.components + c];
      colors[i][static_cast<int>(c)] = std::isfinite(value) ? std::clamp(value, 0.0f, 1.0f) : 1.0f;
      white &= value == 1.0f;
    }
  if (white) colors.clear();
  return colors;
}

Expected<std::vector<Vec2>> read_uv(const ImportContext& context, const AttributeReader& reader,
                                    const char* name) {
  KILN_TRY(const FloatArray array, reader.read(name, 2, 2));
  for (size_t i = 0; i < array.values.size(); ++i)
    if (!std::isfinite(array.values[i]))
      return context.bad(text("{}: {} of vertex {} is not finite", reader.who(), name, i / 2));
  return as_vectors<Vec2>(array);
}

Status read_attributes(const ImportContext& context, const AttributeReader& reader, bool keep_uv0,
                       PrimitiveResult& result) {
  Mesh& mesh = result.mesh;
  if (reader.has("NORMAL")) {
    KILN_TRY(const FloatArray normals, reader.read("NORMAL", 3, 3));
    mesh.normals = as_vectors<Vec3>(normals);
  }
  if (keep_uv0 && reader.has("TEXCOORD_0")) {
    KILN_TRY(mesh.uv[0], read_uv(context, reader, "TEXCOORD_0"));
  }
  result.missing_uv0 = keep_uv0 && mesh.uv[0].empty();
  if (reader.has("TEXCOORD_1")) {
    KILN_TRY(mesh.uv[1], read_uv(context, reader, "TEXCOORD_1"));
  }
  if (reader.has("COLOR_0")) {
    KILN_TRY(mesh.colors, read_colors(reader));
  }
  return {};
}

Expected<PrimitiveResult> read_primitive(const ImportContext& context, const PrimitiveRequest& request) {
  const GltfMesh& file_mesh = context.model.meshes[request.mesh];
  const GltfPrimitive& primitive = file_mesh.primitives[request.primitive];
  PrimitiveResult result;
  result.mesh.name = file_mesh.name.empty() ? text("mesh {}", request.mesh) : file_mesh.name;
  AttributeReader reader(context, primitive, primitive_name(context, request));
  if (primitive.mode < 0 || primitive.mode > 6)
    return context.bad(text("{}: mode {} does not exist", reader.who(), primitive.mode));
  result.not_triangles = primitive.mode < 4;
  if (result.not_triangles || !reader.has("POSITION")) return result;

  KILN_TRY(result.mesh.positions, read_positions(context, reader));
  reader.set_vertices(result.mesh.positions.size());
  KILN_TRY(const std::vector<uint32_t> indices,
           read_vertex_indices(context, primitive, reader.who(), result.mesh.positions.size()));
  Triangles triangles = triangulate(indices, primitive.mode);
  result.file_triangles = triangles.vertices.size();
  result.flat_triangles = remove_flat_triangles(result.mesh.positions, triangles);
  result.repeated_triangles = remove_repeated_triangles(result.mesh.positions, triangles);
  KILN_TRY_STATUS(read_attributes(context, reader, request.keep_uv0, result));
  result.mesh.triangles = std::move(triangles.vertices);
  result.mesh.source_triangle = std::move(triangles.source);
  result.generated_normals = result.mesh.normals.empty();
  drop_unused_vertices(result.mesh);
  if (result.generated_normals)
    make_flat_normals(result.mesh);
  else
    result.repaired_normals = repair_normals(result.mesh);
  return result;
}

uint64_t bytes_of(const Mesh& mesh) {
  return mesh.positions.size() * sizeof(Vec3) + mesh.normals.size() * sizeof(Vec3) +
         (mesh.uv[0].size() + mesh.uv[1].size()) * sizeof(Vec2) + mesh.colors.size() * sizeof(Vec4) +
         mesh.triangles.size() * (sizeof(UVec3) + sizeof(uint32_t)) + mesh.name.size();
}

Status take_meshes(const ImportContext& context, uint64_t bytes) {
  return context.document.budget->take(bytes, "its meshes");
}

}  // namespace

Expected<std::vector<PrimitiveResult>> read_primitives(const ImportContext& context,
                                                       const std::vector<PrimitiveRequest>& requests) {
  std::vector<Expected<PrimitiveResult>> read(requests.size());
  parallel_for(requests.size(), [&](size_t i) {
    if (context.document.budget->is_spent()) return;
    read[i] = read_primitive(context, requests[i]);
    // What is kept of it; what it took while it was read is bounded by the file.
    if (read[i]) static_cast<void>(take_meshes(context, bytes_of(read[i]->mesh)));
  });
  KILN_TRY_STATUS(take_meshes(context, 0));  // one refusal, whichever thread met it
  std::vector<PrimitiveResult> results;
  for (auto& one : read) {
    if (!one) return tl::unexpected<Error>(std::move(one).error());
    results.push_back(std::move(*one));
  }
  return results;
}

void note_primitives(const ImportContext& context, const std::vector<PrimitiveRequest>& requests,
                     const std::vector<PrimitiveResult>& results, ImportNotes& notes) {
  Finding flat, repeated, empty, lines, generated, repaired, no_uv, morphed;
  size_t flat_triangles = 0, repeated_triangles = 0, repaired_normals = 0;
  for (size_t i = 0; i < results.size(); ++i) {
    const PrimitiveResult& r = results[i];
    const std::string name = primitive_name(context, requests[i]);
    flat_triangles += r.flat_triangles;
    repeated_triangles += r.repeated_triangles;
    repaired_normals += r.repaired_normals;
    if (r.not_triangles) lines.add(name);
    if (!r.not_triangles && r.mesh.triangles.empty()) empty.add(name);
    if (r.flat_triangles) flat.add(name);
    if (r.repeated_triangles) repeated.add(name);
    if (r.mesh.triangles.empty()) continue;
    if (r.generated_normals) generated.add(name);
    if (r.repaired_normals) repaired.add(name);
    if (r.missing_uv0) no_uv.add(name);
    if (context.model.meshes[requests[i].mesh].primitives[requests[i].primitive].morphed) morphed.add(name);
  }
  using Kind = ImportNote::Kind;
  const auto note = [&notes](const Finding& finding, Kind kind, const std::string& what) {
    if (!finding.empty())
      add_note(notes, kind, text("{}, in {}", what, finding.list("primitive", "primitives")));
  };
  note(flat, Kind::kIgnored, text("triangles without area are left out: {}", flat_triangles));
  note(repeated, Kind::kIgnored,
       text("triangles that repeat another one are left out: {}", repeated_triangles));
  note(empty, Kind::kIgnored, "there is no triangle to bake");
  note(lines, Kind::kIgnored, "points and lines are left out");
  note(generated, Kind::kBaked, "there are no normals: flat ones are made");
  note(repaired, Kind::kApproximated,
       text("{} normals without direction are replaced by those of their triangles", repaired_normals));
  note(no_uv, Kind::kWarning,
       "the material's textures need TEXCOORD_0, which is absent: until it is there, their corner texel "
       "colours all");
  note(morphed, Kind::kApproximated, "morph targets are left out: the base shape is baked");
}

}  // namespace kiln
