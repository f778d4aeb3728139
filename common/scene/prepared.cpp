#include "common/scene/prepared.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {
namespace {

constexpr uint32_t kStructureMagic = 0x53434b31;  // version 1 of the stored form: change on any change
constexpr uint32_t kMeshMagic = 0x4d534831;
constexpr uint32_t kTextureMagic = 0x54585431;

Bytes write_mesh(const Mesh& m) {
  ByteWriter w;
  w.put(kMeshMagic);
  w.put_string(m.name);
  w.put_array(m.positions);
  w.put_array(m.normals);
  w.put_array(m.tangents);
  w.put_array(m.uv[0]);
  w.put_array(m.uv[1]);
  w.put_array(m.colors);
  w.put_array(m.triangles);
  w.put_array(m.source_triangle);
  return w.take();
}

Expected<Mesh> read_mesh(std::span<const std::byte> bytes) {
  ByteReader r(bytes);
  Mesh m;
  const bool magic = r.get<uint32_t>() == kMeshMagic;
  m.name = r.get_string();
  m.positions = r.get_array<Vec3>();
  m.normals = r.get_array<Vec3>();
  m.tangents = r.get_array<Vec4>();
  m.uv[0] = r.get_array<Vec2>();
  m.uv[1] = r.get_array<Vec2>();
  m.colors = r.get_array<Vec4>();
  m.triangles = r.get_array<UVec3>();
  m.source_triangle = r.get_array<uint32_t>();
  if (!magic || !r.at_end()) return fail(ErrorKind::kInvalidInput, "a mesh chunk is damaged");
  return m;
}

Bytes write_texture(const Texture& t) {
  ByteWriter w;
  w.put(kTextureMagic);
  w.put_string(t.name);
  w.put(t.width);
  w.put(t.height);
  w.put(t.channels);
  w.put(t.format);
  w.put(t.wrap_s);
  w.put(t.wrap_t);
  w.put<uint8_t>(t.nearest);
  w.put_array(t.texels);
  return w.take();
}

Expected<Texture> read_texture(std::span<const std::byte> bytes) {
  ByteReader r(bytes);
  Texture t;
  const bool magic = r.get<uint32_t>() == kTextureMagic;
  t.name = r.get_string();
  t.width = r.get<uint32_t>();
  t.height = r.get<uint32_t>();
  t.channels = r.get<uint32_t>();
  t.format = r.get<TexelFormat>();
  t.wrap_s = r.get<Wrap>();
  t.wrap_t = r.get<Wrap>();
  t.nearest = r.get<uint8_t>() != 0;
  t.texels = r.get_array<std::byte>();
  if (!magic || !r.at_end()) return fail(ErrorKind::kInvalidInput, "a texture chunk is damaged");
  return t;
}

void put_records(ByteWriter& w, const std::vector<Record>& records) {
  w.put<uint64_t>(records.size());
  for (const Record& record : records) {
    w.put_string(record.type);
    w.put_string(record.name);
    w.put(record.to_world);
    w.put<uint64_t>(record.properties.size());
    for (const Property& p : record.properties) {
      w.put_string(p.name);
      w.put_array(p.numbers);
      w.put_string(p.word);
      w.put(p.texture);
    }
  }
}

std::vector<Record> get_records(ByteReader& r) {
  std::vector<Record> records(r.get_count(16));
  for (Record& record : records) {
    record.type = r.get_string();
    record.name = r.get_string();
    record.to_world = r.get<Mat4x3>();
    record.properties.resize(r.get_count(24));
    for (Property& p : record.properties) {
      p.name = r.get_string();
      p.numbers = r.get_array<double>();
      p.word = r.get_string();
      p.texture = r.get<TextureUse>();
    }
    if (!r.ok()) break;
  }
  return records;
}

// A black twin of a material that reflects nothing; its coverage stays the same.
Record black_of(const Record& material) {
  Record black;
  black.type = "unlit";
  black.name = material.name;
  const Property* base = material.find("base_color");
  const bool faded = base && base->numbers.size() == 4;
  black.properties.push_back({"base_color", {0, 0, 0, faded ? base->numbers[3] : 1.0}, {}, {}});
  for (const char* kept : {"alpha_mode", "alpha_cutoff", "double_sided"})
    if (const Property* p = material.find(kept)) black.properties.push_back(*p);
  const Property *mode = material.find("alpha_mode"), *texture = material.find("base_color_texture");
  if (texture && mode && mode->word != "opaque") black.properties.push_back(*texture);
  return black;
}

// Materials as sent, and the material of each instance: black twins for those that reflect nothing follow the
// others.
struct SentMaterials {
  std::vector<Record> records;
  std::vector<uint32_t> of_instance;
};
SentMaterials sent_materials(const Scene& scene) {
  SentMaterials sent{scene.materials, {}};
  std::vector<uint32_t> twin(scene.materials.size(), 0);
  for (const Instance& i : scene.instances) {
    sent.of_instance.push_back(i.material);
    if (i.reflect) continue;
    if (!twin[i.material]) {
      twin[i.material] = static_cast<uint32_t>(sent.records.size());
      sent.records.push_back(black_of(scene.materials[i.material]));
    }
    sent.of_instance.back() = twin[i.material];
  }
  return sent;
}

struct Structure {
  std::vector<Digest> meshes, textures;
  Scene scene;  // without meshes and textures
};

Expected<Structure> read_structure(std::span<const std::byte> bytes) {
  ByteReader r(bytes);
  Structure s;
  const bool magic = r.get<uint32_t>() == kStructureMagic;
  s.meshes = r.get_array<Digest>();
  s.textures = r.get_array<Digest>();
  s.scene.instances.resize(r.get_count(sizeof(Mat4x3)));
  for (Instance& i : s.scene.instances) {
    i.mesh = r.get<uint32_t>();
    i.material = r.get<uint32_t>();
    i.to_world = r.get<Mat4x3>();
    i.name = r.get_string();
    i.node = r.get<uint32_t>();
    i.file_mesh = r.get<uint32_t>();
    i.file_primitive = r.get<uint32_t>();
    if (!r.ok()) break;
  }
  s.scene.materials = get_records(r);
  s.scene.lights = get_records(r);
  if (r.ok() && !r.at_end()) {  // only where not everything casts
    const std::vector<uint8_t> casts = r.get_array<uint8_t>();
    if (casts.size() != s.scene.instances.size())
      return fail(ErrorKind::kInvalidInput, "a scene structure chunk is damaged");
    for (size_t i = 0; i < casts.size(); ++i) s.scene.instances[i].cast = casts[i] != 0;
  }
  if (!magic || !r.at_end()) return fail(ErrorKind::kInvalidInput, "a scene structure chunk is damaged");
  return s;
}

}  // namespace

Digest ChunkStore::add(Bytes bytes) {
  const Digest id = sha256(bytes);
  const size_t size = bytes.size();
  if (chunks_.emplace(id, std::move(bytes)).second) total_ += size;
  return id;
}

const Bytes* ChunkStore::find(const Digest& id) const {
  const auto it = chunks_.find(id);
  return it == chunks_.end() ? nullptr : &it->second;
}

Digest write_scene(const Scene& scene, ChunkStore& store) {
  ByteWriter w;
  w.put(kStructureMagic);
  std::vector<Digest> ids;
  for (const Mesh& mesh : scene.meshes) ids.push_back(store.add(write_mesh(mesh)));
  w.put_array(ids);
  ids.clear();
  for (const Texture& texture : scene.textures) ids.push_back(store.add(write_texture(texture)));
  w.put_array(ids);
  const SentMaterials materials = sent_materials(scene);
  w.put<uint64_t>(scene.instances.size());
  for (const Instance& i : scene.instances) {
    w.put(i.mesh);
    w.put(materials.of_instance[static_cast<size_t>(&i - scene.instances.data())]);
    w.put(i.to_world);
    w.put_string(i.name);
    w.put(i.node);
    w.put(i.file_mesh);
    w.put(i.file_primitive);
  }
  put_records(w, materials.records);
  put_records(w, scene.lights);
  if (std::any_of(scene.instances.begin(), scene.instances.end(),
                  [](const Instance& i) { return !i.cast; })) {
    std::vector<uint8_t> casts;
    for (const Instance& i : scene.instances) casts.push_back(i.cast);
    w.put_array(casts);
  }
  return store.add(w.take());
}

Expected<std::vector<Digest>> scene_chunks(std::span<const std::byte> structure) {
  KILN_TRY(Structure s, read_structure(structure));
  std::vector<Digest> ids = s.meshes;
  ids.insert(ids.end(), s.textures.begin(), s.textures.end());
  return ids;
}

Expected<Scene> read_scene(std::span<const std::byte> structure,
                           const std::function<const Bytes*(const Digest&)>& find) {
  KILN_TRY(Structure s, read_structure(structure));
  for (const Digest& id : s.meshes) {
    const Bytes* bytes = find(id);
    if (!bytes) return fail(ErrorKind::kUnavailable, text("mesh chunk {} is missing", id.hex()));
    KILN_TRY(Mesh mesh, read_mesh(*bytes));
    s.scene.meshes.push_back(std::move(mesh));
  }
  for (const Digest& id : s.textures) {
    const Bytes* bytes = find(id);
    if (!bytes) return fail(ErrorKind::kUnavailable, text("texture chunk {} is missing", id.hex()));
    KILN_TRY(Texture texture, read_texture(*bytes));
    s.scene.textures.push_back(std::move(texture));
  }
  KILN_TRY_STATUS(check_scene(s.scene));
  return std::move(s.scene);
}

Status check_scene(const Scene& scene) {
  const auto bad = [](std::string what) { return fail(ErrorKind::kInvalidInput, std::move(what)); };
  for (const Mesh& m : scene.meshes) {
    const size_t n = m.positions.size();
    if (n >= uint64_t{1} << 32) return bad(text("mesh '{}' has too many vertices", m.name));
    if (m.normals.size() != n) return bad(text("mesh '{}' has no normal for every vertex", m.name));
    for (size_t size : {m.tangents.size(), m.uv[0].size(), m.uv[1].size(), m.colors.size()})
      if (size != 0 && size != n) return bad(text("mesh '{}' has an attribute of another length", m.name));
    if (m.source_triangle.size() != m.triangles.size())
      return bad(text("mesh '{}' has {} triangles and {} sources", m.name, m.triangles.size(),
                      m.source_triangle.size()));
    for (const Vec3& p : m.positions)
      if (!is_finite(p)) return bad(text("mesh '{}' has a position that is not finite", m.name));
    for (const UVec3& t : m.triangles)
      if (t.x >= n || t.y >= n || t.z >= n) return bad(text("mesh '{}' has an index out of range", m.name));
  }
  for (const Texture& t : scene.textures) {
    const bool shape = t.width > 0 && t.height > 0 && t.channels >= 1 && t.channels <= 4 &&
                       t.width <= 1u << 16 && t.height <= 1u << 16 && static_cast<uint32_t>(t.format) <= 2 &&
                       static_cast<uint32_t>(t.wrap_s) <= 2 && static_cast<uint32_t>(t.wrap_t) <= 2;
    if (!shape || t.texels.size() != size_t{t.width} * t.height * t.texel_bytes())
      return bad(text("texture '{}' has a wrong shape", t.name));
  }
  for (const Instance& i : scene.instances) {
    if (i.mesh >= scene.meshes.size() || i.material >= scene.materials.size())
      return bad(text("instance '{}' names a mesh or material that does not exist", i.name));
    if (!(std::abs(determinant(i.to_world)) > 0) || !is_finite(i.to_world[3]))
      return bad(text("instance '{}' has a singular transform", i.name));
  }
  for (const auto* records : {&scene.materials, &scene.lights})
    for (const Record& record : *records)
      for (const Property& p : record.properties)
        if (p.texture.texture < -1 || p.texture.texture >= static_cast<int64_t>(scene.textures.size()) ||
            p.texture.uv_set > 1)
          return bad(text("'{}' names a texture or UV set that does not exist", record.name));
  return {};
}

}  // namespace kiln
