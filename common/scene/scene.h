// The prepared scene: the part of a scene file that a bake needs, independent of the file format.
// Lights and materials are records {type, name, properties}. The worker's rooms interpret the types; import
// writes them, and plan and the report look at a few. Scene and wire never need to change for a new one.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "common/image/image.h"
#include "common/math/vec.h"

namespace kiln {

// One glTF primitive's geometry in its own space. Every index is below positions.size(); positions are
// finite; triangles have positive area; optional arrays are empty or of positions.size().
struct Mesh {
  std::string name;
  std::vector<Vec3> positions;
  std::vector<Vec3> normals;   // unit; always present (generated where the file has none)
  std::vector<Vec4> tangents;  // xyz unit, w = +-1
  std::vector<Vec2> uv[2];     // TEXCOORD_0, TEXCOORD_1 (v downwards, as glTF)
  std::vector<Vec4> colors;    // COLOR_0, linear RGBA
  std::vector<UVec3> triangles;
  std::vector<uint32_t> source_triangle;  // index of each kept triangle in the file's primitive
};

struct Instance {
  uint32_t mesh = 0;
  uint32_t material = 0;  // index into Scene::materials
  Mat4x3 to_world{1.0f};  // never singular; a negative determinant mirrors
  std::string name;       // node name, for messages
  uint32_t node = 0;      // node, mesh and primitive of the file, for the glTF that is written
  uint32_t file_mesh = 0, file_primitive = 0;
  // The object's role in light transport (extras.kiln).
  bool receive = true;  // has texels
  bool cast = true;     // rays hit it
  bool reflect = true;  // reflects and emits light
};

// Where a property is a texture: which one, which UV set, and the affine map of KHR_texture_transform:
// uv' = (m[0] u + m[1] v + m[2], m[3] u + m[4] v + m[5]).
struct TextureUse {
  int32_t texture = -1;  // index into Scene::textures
  uint32_t uv_set = 0;
  float m[6] = {1, 0, 0, 0, 1, 0};
};

struct Property {
  std::string name;
  std::vector<double> numbers;
  std::string word;
  TextureUse texture;
};

struct Record {
  std::string type;
  std::string name;
  Mat4x3 to_world{1.0f};  // lights: the node's transform, along -z as glTF
  std::vector<Property> properties;

  const Property* find(std::string_view property) const {
    for (const Property& p : properties)
      if (p.name == property) return &p;
    return nullptr;
  }
};

// Types that import writes, with their properties (numbers unless said otherwise):
//   lights    "directional"  color[3], intensity (lux), angle (degrees), bake (word: full|indirect|none)
//             "point"        color[3], intensity (cd), range (m, absent: no limit), bake
//             "spot"         as point, inner, outer (cone half angles, radians)
//             "ies"          color[3], intensity (factor), vertical[] and horizontal[] (degrees; type C, from
//                            -z, and from +x towards +y: one, or rising from 0 to 360), candela (texture,
//                            float32, one channel, vertical angles wide and horizontal ones high), bake
//             "rectangle"    radiance[3], size[2] (m, along x and y), sides (1: shines along -z, 2), bake
//             "disc"         radiance[3], radius (m), sides, bake
//             "environment"  radiance[3], image (texture, float32 RGB, equirectangular: u = 0.5 is +x,
//                            growing towards +z; v = 0 is +y; times radiance), rotation (degrees about
//                            +Y), bake
//   materials "metallic_roughness"
//                            base_color[4], base_color_texture, metallic, roughness,
//                            metallic_roughness_texture (G roughness, B metallic), emission[3] (factor x
//                            strength), emission_texture, alpha_mode (word: opaque|mask|blend), alpha_cutoff,
//                            double_sided (0|1), normal_texture (linear RGB, 2 c - 1 in the tangent frame of
//                            the coordinates it uses), normal_scale, ior, specular, specular_texture (its
//                            only channel), specular_color[3], specular_color_texture, transmission,
//                            transmission_texture (R), absorption[3] (of the inside, 1/m; absent: thin),
//                            clearcoat, clearcoat_texture (R), clearcoat_roughness,
//                            clearcoat_roughness_texture (G), sheen_color[3], sheen_color_texture,
//                            sheen_roughness, sheen_roughness_texture (its only channel)
//             "diffuse"      base_color[4], base_color_texture, metallic, metallic_roughness_texture (B),
//                            emission[3], emission_texture, transmission, transmission_texture (R),
//                            alpha_mode, alpha_cutoff, double_sided
//             "unlit"        base_color[4], base_color_texture, alpha_mode, alpha_cutoff, double_sided
struct Scene {
  std::vector<Mesh> meshes;
  std::vector<Instance> instances;
  std::vector<Record> materials;
  std::vector<Record> lights;
  std::vector<Texture> textures;

  size_t triangle_count() const {  // of all instances
    size_t n = 0;
    for (const Instance& i : instances) n += meshes[i.mesh].triangles.size();
    return n;
  }
};

}  // namespace kiln
