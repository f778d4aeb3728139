#include "coordinator/scene/import/environment.h"

#include <algorithm>

#include "common/base/format.h"
#include "coordinator/scene/document/uri.h"
#include "coordinator/scene/imageio/imageio.h"
#include "coordinator/scene/import/cube_map.h"
#include "coordinator/scene/import/hot_spots.h"
#include "coordinator/scene/import/lights.h"
#include "coordinator/scene/import/nodes.h"
#include "coordinator/scene/import/records.h"
#include "coordinator/scene/import/textures.h"

namespace kiln {
namespace {

using Kind = ImportNote::Kind;
constexpr const char* kExtension = "EXT_lights_image_based";
constexpr uint32_t kMaxEnvironmentWidth = 4096;  // 0.09 degrees: finer than any diffuse shadow
constexpr uint32_t kMaxFace = 1024;

// `radiance` multiplies the image where there is one.
Record make_record(const BakeSettings& settings, const std::string& name, std::vector<double> radiance,
                   const std::string& bake) {
  for (double& r : radiance) r *= settings.environment_strength;
  Record record;
  record.type = "environment";
  record.name = name;
  put_numbers(record, "radiance", std::move(radiance));
  put_numbers(record, "rotation", {settings.environment_rotation});
  put_word(record, "bake", bake);
  return record;
}

// In the scene's frame, rotated as the worker rotates the image.
void note_hot_spot(const Record& record, const std::string& name, const HotSpot& spot, ImportNotes& notes) {
  const double turn = record.find("rotation")->numbers[0] * M_PI / 180;
  const double x = spot.direction.x * std::cos(turn) + spot.direction.z * std::sin(turn),
               z = spot.direction.z * std::cos(turn) - spot.direction.x * std::sin(turn);
  add_note(
      notes, Kind::kNote,
      text("the environment '{}' has a hot spot, as of a sun left in the image: {:.0f} % of its light comes "
           "from {:.2g} of the sphere, towards ({:.3f}, {:.3f}, {:.3f}). It is sampled and converges; its "
           "shadows are as soft as its texels, and --sun would say it sharper",
           name, 100 * spot.share, spot.solid_angle / (4 * M_PI), x, spot.direction.y, z));
}

// The record's existing radiance scales the image.
void put_image(Record& record, Texture image, std::vector<Texture>& textures, ImportNotes& notes) {
  if (image.width > kMaxEnvironmentWidth) {
    add_note(notes, Kind::kApproximated,
             text("the environment '{}' of {} x {} texels is reduced to at most {} texels wide", image.name,
                  image.width, image.height, kMaxEnvironmentWidth));
    image = reduce_texture(std::move(image), kMaxEnvironmentWidth);
  }
  if (const auto spot = find_hot_spot(image)) note_hot_spot(record, image.name, *spot, notes);
  TextureUse use;
  use.texture = static_cast<int32_t>(textures.size());
  put_texture(record, "image", use);
  textures.push_back(std::move(image));
}

Expected<std::optional<Record>> from_settings(const BakeSettings& settings, std::vector<Texture>& textures,
                                              ImportNotes& notes) {
  if (const auto radiance = parse_radiance(settings.environment)) {
    for (const double r : *radiance)
      if (!(r >= 0) || !std::isfinite(static_cast<float>(r)))
        return fail(ErrorKind::kUsage,
                    text("environment {}: {} is not a valid radiance", settings.environment, r));
    if (*radiance == std::vector<double>{0, 0, 0}) return std::optional<Record>();
    return make_record(settings, "environment " + settings.environment, *radiance, "full");
  }
  KILN_TRY(Texture image, read_environment(settings.environment));
  // Not the whole path: the scene's bytes must not depend on the location of its files.
  const std::string name = std::filesystem::path(settings.environment).filename().string();
  Record record = make_record(settings, "environment " + name, {1, 1, 1}, "full");
  put_image(record, std::move(image), textures, notes);
  return record;
}

// Faces are JPEG or three-channel PNG (plain sRGB), or four-channel PNG in RGBD: colours divided by alpha.
Expected<CubeFace> read_face(const ImportContext& context, int image) {
  KILN_TRY(const Bytes bytes, read_image_bytes(context, image));
  KILN_TRY(Texture decoded,
           decode_image(bytes, text("{}: {}", context.document.path.string(), image_name(context, image))));
  if (decoded.width != decoded.height)
    return context.bad(text("{}: {} x {} texels are not a cube's face", image_name(context, image),
                            decoded.width, decoded.height));
  if (decoded.width > kMaxFace)
    return context.bad(text("{}: {} texels a side; a cube's faces of up to {} are read",
                            image_name(context, image), decoded.width, kMaxFace));
  CubeFace face;
  face.size = decoded.width;
  face.texels.resize(size_t{face.size} * face.size);
  const uint32_t n = decoded.channels;
  for (size_t i = 0; i < face.texels.size(); ++i) {
    const auto coded = [&](uint32_t c) { return static_cast<uint8_t>(decoded.texels[i * n + c]) / 255.0f; };
    const float divisor = n == 4 ? std::max(coded(3), 1 / 255.0f) : 1.0f;
    for (uint32_t c = 0; c < 3; ++c)
      face.texels[i][static_cast<int>(c)] = srgb_to_linear(coded(n >= 3 ? c : 0)) / divisor;
  }
  return face;
}

Expected<std::array<CubeFace, 6>> read_faces(const ImportContext& context, const GltfValue& light) {
  const GltfValue* mips = light.find("specularImages");
  const auto images = mips && !mips->items.empty() ? mips->items[0].numbers(6) : std::nullopt;
  if (!images) return context.bad("specularImages does not name six images");
  std::array<CubeFace, 6> faces;
  for (size_t i = 0; i < 6; ++i) {
    const double image = (*images)[i];
    KILN_TRY(faces[i], read_face(context, image >= 0 && image < 1e9 ? static_cast<int>(image) : -1));
    if (faces[i].size != faces[0].size)
      return context.bad(text("the cube's faces have {} and {} texels a side, which must be equal",
                              faces[0].size, faces[i].size));
  }
  return faces;
}

// Our own key, because no extension covers an equirectangular image:
//   "scenes": [{"extras": {"kiln": {"environment": {"image": "sky.hdr", "strength": 1, "rotation": 0}}}}]
// "image" is a relative URI; "strength" (1) and "rotation" (0, degrees about +Y) have the meaning of the
// options of those names and combine with them.
Expected<std::optional<Record>> from_extras(const ImportContext& context, const GltfValue& environment,
                                            std::vector<Texture>& textures, ImportNotes& notes) {
  const std::string who = "extras.kiln.environment of the scene";
  const GltfValue* uri = environment.find("image");
  if (!uri || uri->word.empty()) return context.bad(text("{}: image is not a URI", who));
  double factor[2] = {1, 0};
  const char* names[2] = {"strength", "rotation"};
  for (int i = 0; i < 2; ++i) {
    const GltfValue* value = environment.find(names[i]);
    if (!value) continue;
    if (value->kind != GltfValue::Kind::kNumber || !std::isfinite(static_cast<float>(value->number)) ||
        (i == 0 && value->number < 0))
      return context.bad(text("{}: {} is no {}", who, names[i], i == 0 ? "scale" : "angle"));
    factor[i] = value->number;
  }
  if (factor[0] == 0) return std::optional<Record>();
  const auto path = resolve_uri(context.document.path.parent_path(), uri->word);
  if (!path) return context.bad(text("{}: {}", who, path.error().message));
  KILN_TRY(Texture image, read_environment(*path));
  Record record =
      make_record(context.settings, "environment " + uri->word, {factor[0], factor[0], factor[0]}, "full");
  for (Property& property : record.properties)
    if (property.name == "rotation") property.numbers[0] += factor[1];
  put_image(record, std::move(image), textures, notes);
  return record;
}

Expected<std::optional<Record>> from_file(const ImportContext& context, const GltfScene& scene,
                                          std::vector<Texture>& textures, ImportNotes& notes) {
  const GltfValue* kiln = scene.extras.find("kiln");
  if (const GltfValue* environment = kiln ? kiln->find("environment") : nullptr)
    return from_extras(context, *environment, textures, notes);
  const auto use = scene.extensions.find(kExtension);
  const auto root = context.model.extensions.find(kExtension);
  if (use == scene.extensions.end()) return std::optional<Record>();
  const GltfValue* lights = root == context.model.extensions.end() ? nullptr : root->second.find("lights");
  const int index = use->second.index("light");
  if (!lights || index < 0 || static_cast<size_t>(index) >= lights->items.size())
    return context.bad(text("the scene names image-based light {}, which does not exist", index));
  const GltfValue& light = lights->items[static_cast<size_t>(index)];
  const std::string who = text("image-based light {}", index);
  KILN_TRY(std::string bake, [&]() -> Expected<std::string> {
    const GltfValue* extras = light.find("extras");
    return extras ? bake_word(context, who, *extras) : std::string();
  }());
  const double intensity = light.number_or("intensity", 1);
  if (intensity == 0) return std::optional<Record>();
  auto faces = read_faces(context, light);
  if (!faces || !(intensity >= 0) || !std::isfinite(static_cast<float>(intensity))) {
    add_note(notes, Kind::kWarning,
             text("{} is left out: {}; --environment gives another", who,
                  faces ? text("intensity {} is not a valid intensity", intensity) : faces.error().message));
    return std::optional<Record>();
  }
  const auto q = light.numbers("rotation", 4).value_or(std::vector<double>{0, 0, 0, 1});
  const double rotation[4] = {q[0], q[1], q[2], q[3]};
  Record record =
      make_record(context.settings, who, {intensity, intensity, intensity}, bake.empty() ? "full" : bake);
  put_image(record, cube_to_equirectangular(*faces, rotation), textures, notes);
  return record;
}

}  // namespace

Expected<std::optional<Record>> read_environment_light(const ImportContext& context,
                                                       std::vector<Texture>& textures, ImportNotes& notes) {
  if (context.settings.environment_strength == 0) return std::optional<Record>();
  if (!context.settings.environment.empty()) return from_settings(context.settings, textures, notes);
  KILN_TRY(const GltfScene* scene, baked_scene(context));
  if (!scene) return std::optional<Record>();
  return from_file(context, *scene, textures, notes);
}

}  // namespace kiln
