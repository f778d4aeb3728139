#include "coordinator/output/probes/probe_files.h"

#include <algorithm>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "common/probes/octahedral.h"
#include "coordinator/output/probes/bevy.h"
#include "coordinator/output/probes/shader_textures.h"
#include "coordinator/scene/imageio/exr.h"

namespace kiln {
namespace {

void write_vector(JsonWriter& w, std::string_view key, const DVec3& v) {
  w.key(key).begin_array().value(v.x).value(v.y).value(v.z).end_array();
}
void write_vector(JsonWriter& w, std::string_view key, const UVec3& v) {
  w.key(key).begin_array().value(v.x).value(v.y).value(v.z).end_array();
}

// A file of Bevy's, and the transform of its entity.
struct BevyFile {
  std::string name;
  UVec3 voxels;
  DVec3 centre, size;
};

void write_bevy(JsonWriter& w, const BevyFile& b) {
  w.key("bevy").begin_object().pair("file", b.name);
  write_vector(w, "voxels", b.voxels);
  write_vector(w, "translation", b.centre);
  write_vector(w, "scale", b.size);
  w.pair("intensity", 1).end_object();
}

void write_volume(JsonWriter& w, const ProbeVolume& v, const BevyFile* bevy) {
  w.begin_object().pair("name", v.name);
  if (v.node) w.pair("node", *v.node);
  write_vector(w, "min", v.low);
  write_vector(w, "max", v.high());
  w.pair("spacing", v.spacing).pair("levels", v.levels).pair("visibility", v.visibility);
  write_vector(w, "roots", v.roots);
  if (bevy) write_bevy(w, *bevy);
  w.key("bricks").begin_array();
  for (const ProbeBrick& b : v.bricks) {
    w.begin_object();
    write_vector(w, "corner", b.corner);
    w.pair("level", b.level).pair("parent", b.parent).pair("children", b.children).pair("coarser", b.coarser);
    w.key("probes").begin_array();
    for (const uint32_t p : b.probes) w.value(p);
    w.end_array().end_object();
  }
  w.end_array().end_object();
}

std::string probes_json(std::span<const ProbeVolume> volumes, const ProbeField& field,
                        const std::vector<BevyFile>& bevy) {
  JsonWriter w;
  w.begin_object().pair("version", 1);
  w.pair("probes", uint64_t{field.size()}).pair("columns", kProbeColumns);
  w.pair("light",
         "radiance in orthonormal real harmonics, world axes: L00 1, L1m1 y, L10 z, L11 x, L2m2 xy, L2m1 yz, "
         "L20 3z^2-1, L21 xz, L22 x^2-y^2; E(n) = pi L0 + (2 pi / 3) L1 + (pi / 4) L2");
  w.pair("states", "0 active, 1 moved, 2 inactive");
  if (!field.irradiance.empty()) {
    w.pair("irradiance_side", kIrradianceSide).pair("distance_side", kDistanceSide);
    w.pair("border", 1);  // on every side, not counted in the sides
  }
  w.key("volumes").begin_array();
  for (size_t i = 0; i < volumes.size(); ++i) write_volume(w, volumes[i], bevy.empty() ? nullptr : &bevy[i]);
  return w.end_array().end_object().take();
}

struct Sheet {
  uint32_t columns, rows;
  explicit Sheet(size_t probes)
      : columns(static_cast<uint32_t>(std::min<size_t>(probes, kProbeColumns))),
        rows(static_cast<uint32_t>((probes + kProbeColumns - 1) / kProbeColumns)) {}
};

// Planes in the order in which they are added.
class PlaneFile {
 public:
  PlaneFile(uint32_t width, uint32_t height) { planes_.width = width, planes_.height = height; }
  template <class Value>
  void add(const std::string& name, size_t count, const Value& value) {
    std::vector<float>& plane = planes_.add(name);
    for (size_t i = 0; i < count; ++i) plane[i] = value(i);
  }
  std::vector<float>& add(const std::string& name) { return planes_.add(name); }
  Status write(const std::filesystem::path& path, const ExrNotes& notes) const {
    std::vector<ExrChannel> channels;
    for (size_t i = 0; i < planes_.names.size(); ++i)
      channels.push_back({planes_.names[i], planes_.data[i].data()});
    return write_exr(path, planes_.width, planes_.height, channels, {}, notes);
  }

 private:
  Planes planes_;
};

Status write_master(const ProbeField& f, const std::filesystem::path& path) {
  const Sheet sheet(f.size());
  PlaneFile file(sheet.columns, sheet.rows);
  for (int k = 0; k < 3; ++k)
    file.add(text("position.{}", "XYZ"[k]), f.size(), [&](size_t i) { return f.place[i][k]; });
  file.add("state", f.size(), [&](size_t i) { return static_cast<float>(f.state[i]); });
  file.add("validity", f.size(), [&](size_t i) { return f.validity[i]; });
  file.add("samples", f.size(), [&](size_t i) { return static_cast<float>(f.samples[i]); });
  for (size_t k = 0; k < kHarmonics; ++k) {
    for (int c = 0; c < 3; ++c)
      file.add(text("{}.{}", kHarmonicNames[k], "RGB"[c]), f.size(),
               [&](size_t i) { return f.light[i][k][c]; });
    file.add(text("error.{}", kHarmonicNames[k]), f.size(), [&](size_t i) { return f.error[i][k]; });
  }
  file.add("error.E", f.size(), [&](size_t i) { return f.irradiance_error[i]; });
  return file.write(path, {{"quantity", "probes: radiance in orthonormal harmonics, docs/probes.md"},
                           {"unit", kRadianceUnit},
                           {"basis", "sh_l2"},
                           {"fit", "project"}});
}

// value(probe, texel inside, channel) in tiles with borders.
template <class Value>
Status write_maps(const ProbeField& f, uint32_t side, const std::vector<std::string>& names,
                  const Value& value, const ExrNotes& notes, const std::filesystem::path& path) {
  const Sheet sheet(f.size());
  const uint32_t tile = side + 2, width = sheet.columns * tile;
  PlaneFile file(width, sheet.rows * tile);
  for (int c = 0; c < static_cast<int>(names.size()); ++c) {
    std::vector<float>& plane = file.add(names[static_cast<size_t>(c)]);
    for (size_t i = 0; i < f.size(); ++i)
      for (uint32_t y = 0; y < tile; ++y)
        for (uint32_t x = 0; x < tile; ++x) {
          uint32_t u = x, v = y;
          octahedral_inside(side, u, v);
          const size_t row = i / kProbeColumns * tile + y, column = i % kProbeColumns * tile + x;
          plane[row * width + column] = value(i, v * side + u, c);
        }
  }
  return file.write(path, notes);
}

Expected<std::vector<BevyFile>> write_bevy_files(std::span<const ProbeVolume> volumes,
                                                 const ProbeField& field,
                                                 const std::filesystem::path& folder) {
  std::vector<BevyFile> files;
  for (const ProbeVolume& v : volumes) {
    KILN_TRY(const BevyVolume b, bevy_volume(v, field));
    KILN_TRY(const Bytes bytes, write_ktx2(b.texture, 0));
    files.push_back({volumes.size() > 1 ? text("probes_bevy.{}.ktx2", files.size()) : "probes_bevy.ktx2",
                     b.voxels, b.centre, b.size});
    KILN_TRY_STATUS(write_file_atomic(folder / files.back().name, bytes));
  }
  return files;
}

Status write_all_maps(const ProbeField& f, const std::filesystem::path& folder) {
  KILN_TRY_STATUS(write_maps(
      f, kIrradianceSide, {"R", "G", "B"},
      [&](size_t probe, uint32_t t, int c) { return f.irradiance[probe * kIrradianceTexels + t][c]; },
      {{"quantity", "E of probes, octahedral"}, {"unit", kIrradianceUnit}},
      folder / "probes_irradiance.exr"));
  return write_maps(
      f, kDistanceSide, {"mean", "square"},
      [&](size_t probe, uint32_t t, int c) { return f.distance[probe * kDistanceTexels + t][c]; },
      {{"quantity", "distance and its square, octahedral"}, {"unit", "m, m^2"}},
      folder / "probes_distance.exr");
}

// Names of what was written.
Expected<std::vector<std::string>> write_textures(const ProbeField& field,
                                                  const std::filesystem::path& folder) {
  constexpr int kZstd = 3;  // the EXR masters beside are compressed too
  const ProbeTextures textures = probe_textures(field);
  std::vector<std::string> names;
  for (const auto& [name, texture] : {std::pair("probes_light.ktx2", &textures.light),
                                      std::pair("probes_irradiance.ktx2", &textures.irradiance),
                                      std::pair("probes_distance.ktx2", &textures.distance)}) {
    if (texture->levels.empty()) continue;
    KILN_TRY(const Bytes bytes, write_ktx2(*texture, kZstd));
    KILN_TRY_STATUS(write_file_atomic(folder / name, bytes));
    names.emplace_back(name);
  }
  return names;
}

}  // namespace

Expected<std::vector<OutputFile>> write_probe_files(std::span<const ProbeVolume> volumes,
                                                    const ProbeField& field, const ProbeFileWish& wish,
                                                    const std::filesystem::path& folder) {
  std::vector<std::string> names{"probes.json", "probes.exr"};
  std::vector<BevyFile> bevy;
  if (wish.bevy) {
    KILN_TRY(bevy, write_bevy_files(volumes, field, folder));
    for (const BevyFile& b : bevy) names.push_back(b.name);
  }
  if (wish.textures) {
    KILN_TRY(const std::vector<std::string> textures, write_textures(field, folder));
    names.insert(names.end(), textures.begin(), textures.end());
  }
  KILN_TRY_STATUS(write_file_atomic(folder / "probes.json", probes_json(volumes, field, bevy)));
  KILN_TRY_STATUS(write_master(field, folder / "probes.exr"));
  if (!field.irradiance.empty()) {
    names.insert(names.end(), {"probes_irradiance.exr", "probes_distance.exr"});
    KILN_TRY_STATUS(write_all_maps(field, folder));
  }
  std::vector<OutputFile> files;
  for (const std::string& name : names) {
    KILN_TRY(const Bytes bytes, read_file(folder / name));
    files.push_back({name, bytes.size(), sha256(bytes), name.ends_with(".exr") || name.ends_with(".json")});
  }
  return files;
}

}  // namespace kiln
