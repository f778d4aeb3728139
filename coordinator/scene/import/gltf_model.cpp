// The only tinygltf include. It is given no buffers and no images, so it opens no file and decodes nothing.
#include "coordinator/scene/import/gltf_model.h"

#include <algorithm>
#include <fstream>  // tinygltf needs it, and forgets it without its file access

#define TINYGLTF_IMPLEMENTATION
#define TINYGLTF_NO_STB_IMAGE
#define TINYGLTF_NO_STB_IMAGE_WRITE
#define TINYGLTF_NO_EXTERNAL_IMAGE
#define TINYGLTF_NO_FS
#include <tiny_gltf.h>

#include "common/base/format.h"

namespace kiln {
namespace {

GltfValue convert(const tinygltf::Value& in) {
  using Kind = GltfValue::Kind;
  GltfValue out;
  if (in.IsNumber()) {
    out.kind = Kind::kNumber;
    out.number = in.GetNumberAsDouble();
  } else if (in.IsBool()) {
    out.kind = Kind::kFlag;
    out.number = in.Get<bool>();
  } else if (in.IsString()) {
    out.kind = Kind::kWord;
    out.word = in.Get<std::string>();
  } else if (in.IsArray()) {
    out.kind = Kind::kArray;
    for (const auto& item : in.Get<tinygltf::Value::Array>()) out.items.push_back(convert(item));
  } else if (in.IsObject()) {
    out.kind = Kind::kObject;
    for (const auto& [name, member] : in.Get<tinygltf::Value::Object>()) out.members[name] = convert(member);
  }
  return out;
}

GltfExtensions convert(const tinygltf::ExtensionMap& in) {
  GltfExtensions out;
  for (const auto& [name, value] : in) out[name] = convert(value);
  return out;
}

GltfBufferView convert(const tinygltf::BufferView& in) {
  return {in.buffer, in.byteOffset, in.byteLength, in.byteStride};
}

GltfAccessor convert(const tinygltf::Accessor& in) {
  GltfAccessor out;
  out.buffer_view = in.bufferView;
  out.offset = in.byteOffset;
  out.count = in.count;
  out.component_type = in.componentType;
  out.components =
      static_cast<uint32_t>(std::max(0, tinygltf::GetNumComponentsInType(static_cast<uint32_t>(in.type))));
  out.normalized = in.normalized;
  if (in.sparse.isSparse)
    out.sparse = GltfAccessor::Sparse{in.sparse.count,
                                      in.sparse.indices.bufferView,
                                      in.sparse.values.bufferView,
                                      in.sparse.indices.byteOffset,
                                      in.sparse.values.byteOffset,
                                      in.sparse.indices.componentType};
  return out;
}

GltfMesh convert(const tinygltf::Mesh& in) {
  GltfMesh out{in.name, {}, convert(in.extras)};
  for (const auto& p : in.primitives)
    out.primitives.push_back(
        {p.attributes, p.indices, p.material, p.mode, !p.targets.empty(), convert(p.extensions)});
  return out;
}

GltfNode convert(const tinygltf::Node& in) {
  GltfNode out;
  out.name = in.name;
  out.mesh = in.mesh;
  out.camera = in.camera;
  out.skin = in.skin;
  out.children = in.children;
  out.matrix = in.matrix;
  out.translation = in.translation;
  out.rotation = in.rotation;
  out.scale = in.scale;
  out.extensions = convert(in.extensions);
  out.extras = convert(in.extras);
  return out;
}

template <class Info>
GltfTextureInfo convert_info(const Info& in) {
  return {in.index, in.texCoord, convert(in.extensions)};
}

GltfMaterial convert(const tinygltf::Material& in) {
  const auto& pbr = in.pbrMetallicRoughness;
  GltfMaterial out;
  out.name = in.name;
  std::copy_n(pbr.baseColorFactor.begin(), 4, out.base_color.begin());  // tinygltf has checked the lengths
  std::copy_n(in.emissiveFactor.begin(), 3, out.emissive.begin());
  out.metallic = pbr.metallicFactor;
  out.roughness = pbr.roughnessFactor;
  out.alpha_cutoff = in.alphaCutoff;
  out.alpha_mode = in.alphaMode;
  out.double_sided = in.doubleSided;
  out.base_color_texture = convert_info(pbr.baseColorTexture);
  out.metallic_roughness_texture = convert_info(pbr.metallicRoughnessTexture);
  out.emissive_texture = convert_info(in.emissiveTexture);
  out.normal_texture = convert_info(in.normalTexture);
  out.normal_scale = in.normalTexture.scale;
  out.extensions = convert(in.extensions);
  out.extras = convert(in.extras);
  return out;
}

GltfSampler convert(const tinygltf::Sampler& in) {
  return {in.magFilter, in.wrapS, in.wrapT};
}

GltfTexture convert(const tinygltf::Texture& in) {
  return {in.name, in.source, in.sampler, convert(in.extensions)};
}

GltfCamera convert(const tinygltf::Camera& in) {
  return {in.name, in.type == "perspective", in.perspective.yfov, in.perspective.aspectRatio};
}

GltfLight convert(const tinygltf::Light& in) {
  return {in.name,
          in.type,
          in.color,
          in.intensity,
          in.range,
          in.spot.innerConeAngle,
          in.spot.outerConeAngle,
          convert(in.extras)};
}

GltfScene convert(const tinygltf::Scene& in) {
  return {in.name, in.nodes, convert(in.extensions), convert(in.extras)};
}

template <class Out, class In>
void convert_all(const std::vector<In>& in, std::vector<Out>& out) {
  out.reserve(in.size());
  for (const In& element : in) out.push_back(convert(element));
}

// tinygltf reports in lines; a message is one sentence.
std::string one_line(std::string lines) {
  while (!lines.empty() && (lines.back() == '\n' || lines.back() == '.')) lines.pop_back();
  std::replace(lines.begin(), lines.end(), '\n', ' ');
  return lines.empty() ? "its structure is not glTF 2.0" : lines;
}

}  // namespace

Expected<GltfModel> parse_gltf_model(const GltfDocument& document) {
  tinygltf::TinyGLTF loader;
  tinygltf::Model in;
  std::string error, warning;
  if (!loader.LoadASCIIFromString(&in, &error, &warning, document.structure.data(),
                                  static_cast<unsigned>(document.structure.size()), ""))
    return fail(ErrorKind::kInvalidInput, text("{}: {}", document.path.string(), one_line(error)));
  // tinygltf drops a primitive that it cannot read with a message and continues, which would shift the
  // others.
  if (error.find("Primitive") != std::string::npos)
    return fail(ErrorKind::kInvalidInput, text("{}: {}", document.path.string(), one_line(error)));
  GltfModel out;
  convert_all(in.bufferViews, out.buffer_views);
  convert_all(in.accessors, out.accessors);
  convert_all(in.meshes, out.meshes);
  convert_all(in.nodes, out.nodes);
  convert_all(in.materials, out.materials);
  convert_all(in.samplers, out.samplers);
  convert_all(in.textures, out.textures);
  convert_all(in.cameras, out.cameras);
  convert_all(in.lights, out.lights);
  convert_all(in.scenes, out.scenes);
  out.default_scene = in.defaultScene;
  out.generator = in.asset.generator;
  out.animated = !in.animations.empty();
  out.extensions_used = in.extensionsUsed;
  out.extensions_required = in.extensionsRequired;
  out.extensions = convert(in.extensions);
  return out;
}

}  // namespace kiln
