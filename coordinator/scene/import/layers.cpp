#include "coordinator/scene/import/layers.h"

#include <algorithm>
#include <cmath>

#include "common/base/format.h"

namespace kiln {
namespace {

using Kind = ImportNote::Kind;
using Role = TextureRequest::Role;

void put_ior(const GltfValue& extension, MaterialReader& reader) {
  double ior = extension.number_or("ior", 1.5);
  // The extension uses 0 for a reflectance of 1.
  if (ior != 0) ior = reader.clamped("ior", ior, 1, 1e6);
  reader.numbers("ior", {ior});
}

void put_specular(const GltfValue& extension, MaterialReader& reader) {
  const double weight = reader.factor(extension, "specularFactor", 1);
  reader.numbers("specular", {weight});
  if (weight == 0) return;
  reader.texture("specular_texture", texture_info(extension, "specularTexture"), Role::kAlpha);
  reader.numbers("specular_color", reader.color(extension, "specularColorFactor", 1, 1e6));
  reader.texture("specular_color_texture", texture_info(extension, "specularColorTexture"), Role::kColor);
}

// KHR_materials_volume, section "Attenuation": transmittance after a distance d is color^(d / distance).
void put_volume(const GltfValue& extension, MaterialReader& reader) {
  if (!(extension.number_or("thicknessFactor", 0) > 0)) return;  // thin: there is no inside
  const double distance = extension.number_or("attenuationDistance", INFINITY);
  const std::vector<double> color = reader.color(extension, "attenuationColor", 1);
  if (texture_info(extension, "thicknessTexture").texture >= 0)
    reader.note(Kind::kApproximated, "its thickness is that of the mesh, the thickness texture is not used");
  if (!(distance > 0)) {
    reader.note(
        Kind::kWarning,
        text("attenuationDistance {} is not a valid distance: nothing is absorbed until it is above 0",
             distance));
    return;
  }
  std::vector<double> absorption;
  for (const double c : color) absorption.push_back(-std::log(std::max(c, 0x1p-24)) / distance);
  if (std::isfinite(distance) && color != std::vector<double>(3, 1.0))
    reader.numbers("absorption", absorption);
}

// Returns whether there is any.
bool put_transmission_share(const GltfValue& extension, MaterialReader& reader) {
  const double share = reader.factor(extension, "transmissionFactor", 0);
  if (share == 0) return false;
  reader.numbers("transmission", {share});
  reader.texture("transmission_texture", texture_info(extension, "transmissionTexture"), Role::kFactors);
  return true;
}

void put_transmission(const GltfMaterial& material, const GltfValue& extension, MaterialReader& reader) {
  if (!put_transmission_share(extension, reader)) return;
  if (const GltfValue* volume = find_extension(material.extensions, "KHR_materials_volume"))
    put_volume(*volume, reader);
}

void put_clearcoat(const GltfValue& extension, MaterialReader& reader) {
  const double weight = reader.factor(extension, "clearcoatFactor", 0);
  if (weight == 0) return;
  reader.numbers("clearcoat", {weight});
  reader.texture("clearcoat_texture", texture_info(extension, "clearcoatTexture"), Role::kFactors);
  reader.numbers("clearcoat_roughness", {reader.factor(extension, "clearcoatRoughnessFactor", 0)});
  reader.texture("clearcoat_roughness_texture", texture_info(extension, "clearcoatRoughnessTexture"),
                 Role::kFactors);
}

void put_sheen(const GltfValue& extension, MaterialReader& reader) {
  const std::vector<double> color = reader.color(extension, "sheenColorFactor", 0);
  if (std::all_of(color.begin(), color.end(), [](double c) { return c == 0; })) return;
  reader.numbers("sheen_color", color);
  reader.texture("sheen_color_texture", texture_info(extension, "sheenColorTexture"), Role::kColor);
  reader.numbers("sheen_roughness", {reader.factor(extension, "sheenRoughnessFactor", 0)});
  reader.texture("sheen_roughness_texture", texture_info(extension, "sheenRoughnessTexture"), Role::kAlpha);
}

}  // namespace

void put_plain_transmission(const GltfMaterial& material, MaterialReader& reader) {
  if (const GltfValue* e = find_extension(material.extensions, "KHR_materials_transmission"))
    put_transmission_share(*e, reader);
}

void put_layers(const GltfMaterial& material, MaterialReader& reader) {
  const auto find = [&](const char* name) { return find_extension(material.extensions, name); };
  if (const GltfValue* e = find("KHR_materials_ior")) put_ior(*e, reader);
  if (const GltfValue* e = find("KHR_materials_specular")) put_specular(*e, reader);
  if (const GltfValue* e = find("KHR_materials_transmission")) put_transmission(material, *e, reader);
  if (const GltfValue* e = find("KHR_materials_clearcoat")) put_clearcoat(*e, reader);
  if (const GltfValue* e = find("KHR_materials_sheen")) put_sheen(*e, reader);
}

}  // namespace kiln
