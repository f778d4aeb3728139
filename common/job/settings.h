// Every option of a bake, once: command line, job file, report and docs/settings come from one table.
#pragma once

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/base/status.h"
#include "common/responses/quantities.h"

namespace kiln {

// The lightmap descriptions that scene.glb carries (docs/gltf.md).
struct GltfLightmaps {
  bool kiln = true, moz = true, epic = false, mx = false;
};

// --max-encode-error auto: half of the reported error, at least 1 %.
constexpr double kAutoBound = -1;

struct BakeSettings {
  std::string layout = "auto";
  uint32_t width = 1024, height = 1024;
  double texels_per_metre = 4;
  uint64_t max_texels = 0;  // 0: no budget
  struct ImportanceBox {
    double low[3], high[3], factor;
  };
  std::vector<ImportanceBox> importance_boxes;
  bool importance_cameras = false;
  double camera_distance = 10;  // metres
  double unseen_density = 1;
  std::string unseen = "keep";  // keep, auto
  bool split = false;           // direct and indirect light in files of their own too
  bool two_pass = false;        // layout pack
  double small_objects = 0;     // metres; 0: size does not matter
  uint32_t page_size = 8192;    // texels
  bool power_of_two = false, block_align = false;
  uint32_t mip_levels = 0;
  std::string unwrap = "auto";        // auto, always
  std::string unwrap_cache = "auto";  // a folder, auto or off
  std::string environment;            // empty: what the scene says; "R,G,B" or a path
  double environment_strength = 1;
  double environment_rotation = 0;  // degrees about +Y
  struct Sun {
    double to_light[3], irradiance[3];
  };
  std::vector<Sun> suns;
  double sun_angle = 0;  // degrees, angular diameter
  bool direct = true, indirect = true;
  uint32_t max_bounces = 64;
  std::string materials = "full";  // full, diffuse
  double error = 0.05, confidence = 0.95;
  std::string error_norm = "mean-square";  // max, mean-square, perceptual
  uint32_t min_samples = 64, max_samples = 262144;
  // The fewest samples of a texel: min_samples, or fewer in a map of many texels that is denoised and baked
  // with an irradiance cache (`cached`) to an error of the map as a whole, unless --min-samples is given.
  uint32_t least_samples(uint64_t texels, bool cached) const;
  // The most that a texel may have. Only the norm mean-square gives many samples to few texels; where every
  // texel may ask for them, without --max-samples it is most_of_each().
  uint32_t most_samples() const;
  uint32_t most_of_each() const;  // at most 16,384, unless --max-samples is given
  double time_limit = 0;          // seconds; 0: none
  bool cache = true, denoise = true;
  std::string basis = "sh_l1", sh_fit = "cap", sh_evaluator = "linear";
  Quantities quantities;         // of the lightmap
  std::string probes = "scene";  // scene, auto, off or a file
  bool probes_asked = false;     // --quantities has probes
  double probe_spacing = 1;      // metres, of --probes auto
  double probe_max_spacing = 0;  // metres; 0: the same
  uint64_t max_probes = 100000;
  bool probe_visibility = false;
  bool probe_dering = false;
  bool probe_bevy = false, probe_textures = false;  // --probe-files
  double ao_distance = 1;                           // metres
  Falloff ao_falloff = Falloff::kNone;
  double visibility_error = 0.05;  // of ao, sky and bent: absolute
  bool seams = true;
  double seam_angle = 5;              // degrees
  uint32_t dilate = 4;                // texels
  uint32_t workers = 0, threads = 0;  // 0: chosen from the processors
  uint32_t tile_texels = 256;
  uint64_t seed = 0;
  std::string sampler = "owen";
  bool contact_cuts = true;  // layout pack
  bool instanced = false;    // scene_instanced.glb, layout pack
  GltfLightmaps gltf_lightmap;
  bool embed_basecolor = true;  // scene_unlit.glb, of bakes with light
  std::string lamps = "drop";   // in scene.glb, those whose light is in the map: drop, keep, mark
  std::string keep_layout;      // charts.json of an earlier bake; empty: none
  std::vector<std::string> encodings = {"bc6h"};
  bool dds = true, ktx2 = true;
  std::string encode_effort = "normal";      // fast, normal, best
  std::string encode_metric = "perceptual";  // linear, log, perceptual
  std::string encode_quantity = "basis";     // basis, irradiance, both
  std::string encode_units = "e";            // e, e-over-pi
  std::string encode_range = "unit";         // unit, fit
  double max_encode_error = kAutoBound;      // 0: no bound
  uint32_t ktx2_zstd = 0;                    // level; 0: none
  bool watertight = false;
  uint32_t lod = 0;                                     // level of MSFT_lod that is baked
  double lod_distance = 0;                              // metres; 0: kLodDistance of an object's size
  double lod_split = 1;                                 // texels; 0: never
  bool preview = true;                                  // pictures of the report
  uint32_t preview_width = 1280, preview_height = 720;  // pixels of each
  std::string variant;  // of KHR_materials_variants; empty: the file's own materials
  std::string camera;   // "NAME" or "X,Y,Z:X,Y,Z[:FOV]"; empty: the file's, or one that is chosen
  std::string isa = "avx2";
  uint32_t lease_ms = 15000;

  // Name of the source that set a row ("command line", "job file x.json"); absent: default.
  std::map<std::string, std::string> source;
};

// One row of the table. `parse` checks and stores, `print` gives the value in the form that parse reads.
struct Setting {
  const char* name;   // key of the job file; the command line's is --name
  const char* value;  // placeholder in --help
  const char* unit;   // "" where it has none
  const char* about;
  Status (*parse)(BakeSettings&, const std::string&);
  std::string (*print)(const BakeSettings&);
};

std::span<const Setting> settings_table();

// Whether light straight from lamps and skies is in the map; a lamp whose extras.kiln.bake is not "full" is
// an exception.
inline bool has_direct_light(const BakeSettings& settings) {
  return settings.quantities.light && settings.direct;
}

// Whether a lightmap is asked for; a bake of probes alone has none.
inline bool wants_lightmap(const BakeSettings& settings) {
  return settings.quantities.light || !settings.quantities.responses.empty();
}

// The names that --encode accepts; coordinator/output/textures defines each.
std::span<const std::string_view> encoding_names();

// Sets one option by name; errors name the option, the value and what is allowed.
Status set_option(BakeSettings& settings, const std::string& name, const std::string& value,
                  const std::string& source);
// Parses the option environment as radiance R,G,B; nullopt if it is a path or empty.
std::optional<std::vector<double>> parse_radiance(const std::string& value);
// The stored basis, with its fit: index into basis_roster(), and the entry.
uint32_t basis_index(const BakeSettings& settings);
const BasisInfo& basis_of(const BakeSettings& settings);
// Rules between options (min <= max, ...). Call once after the last set_option.
Status check_settings(const BakeSettings& settings);

}  // namespace kiln
