#include "coordinator/scene/import/material_reader.h"

#include <algorithm>
#include <cmath>

#include "common/base/format.h"

namespace kiln {
namespace {

using Kind = ImportNote::Kind;

// KHR_texture_transform: translation * rotation * scale, uv as a column.
void apply_transform(const GltfValue& transform, TextureUse& use, int& uv_set) {
  const auto offset = transform.numbers("offset", 2), scale = transform.numbers("scale", 2);
  const double angle = transform.number_or("rotation", 0);
  const double sx = scale ? (*scale)[0] : 1, sy = scale ? (*scale)[1] : 1;
  const double m[6] = {std::cos(angle) * sx,  std::sin(angle) * sy, offset ? (*offset)[0] : 0,
                       -std::sin(angle) * sx, std::cos(angle) * sy, offset ? (*offset)[1] : 0};
  for (int i = 0; i < 6; ++i) use.m[i] = static_cast<float>(m[i]);
  if (transform.index("texCoord") >= 0) uv_set = transform.index("texCoord");
}

}  // namespace

GltfTextureInfo texture_info(const GltfValue& extension, const char* name) {
  GltfTextureInfo info;
  const GltfValue* texture = extension.find(name);
  if (!texture) return info;
  info.texture = texture->index("index");
  info.uv_set = std::max(0, texture->index("texCoord"));
  if (const GltfValue* extensions = texture->find("extensions")) info.extensions = extensions->members;
  return info;
}

void MaterialReader::texture(const char* property, const GltfTextureInfo& info, TextureRequest::Role role,
                             bool keep_alpha) {
  if (info.texture < 0) return;
  TextureUse use;
  int uv_set = info.uv_set;
  if (const GltfValue* transform = find_extension(info.extensions, "KHR_texture_transform"))
    apply_transform(*transform, use, uv_set);
  if (uv_set < 0 || uv_set > 1) {
    note(
        Kind::kWarning,
        text("{} uses TEXCOORD_{}, only 0 and 1 are read: its factor is used alone until it uses one of them",
             property, uv_set));
    return;
  }
  if (!std::all_of(std::begin(use.m), std::end(use.m), [](float v) { return std::isfinite(v); })) {
    note(Kind::kWarning,
         text("the transform of {} is not finite: its factor is used alone until it is", property));
    return;
  }
  use.uv_set = static_cast<uint32_t>(uv_set);
  use.texture = textures_.add({info.texture, role, keep_alpha});
  put_texture(record_, property, use);
}

double MaterialReader::clamped(const char* name, double value, double low, double high) {
  if (value >= low && value <= high) return value;
  note(Kind::kApproximated, text("{} {} is outside of {} to {} and clamped", name, value, low, high));
  return value > high ? high : low;
}

std::vector<double> MaterialReader::color(const GltfValue& extension, const char* name, double otherwise,
                                          double high) {
  std::vector<double> rgb = extension.numbers(name, 3).value_or(std::vector<double>(3, otherwise));
  for (double& c : rgb) c = clamped(name, c, 0, high);
  return rgb;
}

void MaterialReader::note(Kind kind, const std::string& what) {
  add_note(notes_, kind, text("{}: {}", who_, what));
}

}  // namespace kiln
