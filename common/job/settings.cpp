#include "common/job/settings.h"

#include <algorithm>
#include <utility>

#include "common/base/format.h"
#include "common/job/values.h"
#include "common/math/samplers.h"
#include "common/responses/basis.h"

namespace kiln {
namespace {

using namespace values;

Status parse_quantity_list(BakeSettings& b, const std::string& s) {
  KILN_TRY(b.quantities, parse_quantities(s));
  b.probes_asked = std::exchange(b.quantities.probes, false);
  return {};
}

std::string print_quantity_list(const BakeSettings& b) {
  Quantities all = b.quantities;
  all.probes = b.probes_asked;
  return print_quantities(all);
}

Status parse_falloff(BakeSettings& b, const std::string& s) {
  KILN_TRY(b.ao_falloff, find_falloff(s));
  return {};
}

Status parse_resolution(BakeSettings& b, const std::string& s) {
  const size_t x = s.find('x');
  KILN_TRY_STATUS(store_number(b.width, s.substr(0, x), 1, 16384));
  if (x == s.npos) {
    b.height = b.width;
    return {};
  }
  return store_number(b.height, s.substr(x + 1), 1, 16384);
}

Status parse_preview(BakeSettings& b, const std::string& s) {
  b.preview = s != "off";
  if (s == "on" || s == "off") return {};
  const size_t x = s.find('x');
  if (x == s.npos) return refuse(text("'{}' is not on, off or WxH", s));
  KILN_TRY_STATUS(store_number(b.preview_width, s.substr(0, x), 64, 8192));
  return store_number(b.preview_height, s.substr(x + 1), 64, 8192);
}

std::string print_preview(const BakeSettings& b) {
  const BakeSettings usual;
  if (!b.preview) return "off";
  if (b.preview_width == usual.preview_width && b.preview_height == usual.preview_height) return "on";
  return text("{}x{}", b.preview_width, b.preview_height);
}

Status parse_one_sun(BakeSettings& b, const std::string& s) {
  const size_t colon = s.find(':');
  if (colon == s.npos) return refuse("a sun is X,Y,Z:R,G,B (direction to it, irradiance)");
  KILN_TRY(const auto d, numbers(s.substr(0, colon)));
  KILN_TRY(const auto e, numbers(s.substr(colon + 1)));
  if (d.size() != 3 || e.size() != 3) return refuse("a sun is X,Y,Z:R,G,B (direction to it, irradiance)");
  if (d[0] == 0 && d[1] == 0 && d[2] == 0) return refuse("the direction to the sun is zero");
  for (double v : e)
    if (v < 0) return refuse("the irradiance of the sun is negative");
  b.suns.push_back({{d[0], d[1], d[2]}, {e[0], e[1], e[2]}});
  return {};
}

// Several are separated by blanks, as print gives them.
Status parse_sun(BakeSettings& b, const std::string& s) {
  for (size_t at = 0; at <= s.size();) {
    const size_t end = std::min(s.find(' ', at), s.size());
    KILN_TRY_STATUS(parse_one_sun(b, s.substr(at, end - at)));
    at = end + 1;
  }
  return {};
}

std::string print_suns(const BakeSettings& b) {
  std::string out;
  for (const auto& s : b.suns)
    out += text("{}{},{},{}:{},{},{}", out.empty() ? "" : " ", s.to_light[0], s.to_light[1], s.to_light[2],
                s.irradiance[0], s.irradiance[1], s.irradiance[2]);
  return out;
}

// Several are separated by blanks, as print gives them.
Status parse_importance_boxes(BakeSettings& b, const std::string& s) {
  constexpr size_t kMax = 256;
  const auto no_box = [] { return refuse("an importance box is X,Y,Z:X,Y,Z:F (two corners, factor)"); };
  for (size_t at = 0; at <= s.size();) {
    const size_t end = std::min(s.find(' ', at), s.size());
    const std::string word = s.substr(at, end - at);
    at = end + 1;
    const size_t first = word.find(':'), second = first == word.npos ? first : word.find(':', first + 1);
    if (second == word.npos) return no_box();
    KILN_TRY(const auto low, numbers(word.substr(0, first)));
    KILN_TRY(const auto high, numbers(word.substr(first + 1, second - first - 1)));
    if (low.size() != 3 || high.size() != 3) return no_box();
    BakeSettings::ImportanceBox box;
    for (size_t k = 0; k < 3; ++k) {
      box.low[k] = std::min(low[k], high[k]);
      box.high[k] = std::max(low[k], high[k]);
    }
    KILN_TRY_STATUS(store_number(box.factor, word.substr(second + 1), 1.0 / 64, 64));
    if (b.importance_boxes.size() == kMax)
      return refuse(text("there are more than {} importance boxes", kMax));
    b.importance_boxes.push_back(box);
  }
  return {};
}

std::string print_importance_boxes(const BakeSettings& b) {
  std::string out;
  for (const auto& x : b.importance_boxes)
    out += text("{}{},{},{}:{},{},{}:{}", out.empty() ? "" : " ", x.low[0], x.low[1], x.low[2], x.high[0],
                x.high[1], x.high[2], x.factor);
  return out;
}

Status parse_components(BakeSettings& b, const std::string& s) {
  b.direct = s == "direct" || s == "direct,indirect" || s == "indirect,direct";
  b.indirect = s == "indirect" || s == "direct,indirect" || s == "indirect,direct";
  if (!b.direct && !b.indirect)
    return refuse(text("'{}' is not one of direct, indirect, direct,indirect", s));
  return {};
}

Status parse_gltf_lightmaps(BakeSettings& b, const std::string& s) {
  GltfLightmaps& g = b.gltf_lightmap;
  return store_flags(s, {{"kiln", &g.kiln}, {"moz", &g.moz}, {"epic", &g.epic}, {"mx", &g.mx}});
}

std::string print_gltf_lightmaps(const BakeSettings& b) {
  const GltfLightmaps& g = b.gltf_lightmap;
  return print_flags({{"kiln", g.kiln}, {"moz", g.moz}, {"epic", g.epic}, {"mx", g.mx}});
}

Status parse_probe_files(BakeSettings& b, const std::string& s) {
  return store_flags(s, {{"bevy", &b.probe_bevy}, {"textures", &b.probe_textures}});
}

std::string print_probe_files(const BakeSettings& b) {
  return print_flags({{"bevy", b.probe_bevy}, {"textures", b.probe_textures}});
}

Status parse_basis(BakeSettings& b, const std::string& s) {
  KILN_TRY_STATUS(find_basis(s));
  b.basis = s;
  return {};
}

constexpr std::string_view kEncodings[] = {"bc6h",     "bc6h-bc1", "bc6h-plain", "astc-4x4", "astc-6x6",
                                           "astc-8x8", "half",     "rgb9e5",     "rgbe",     "rgbm",
                                           "rgbd",     "exr",      "hdr",        "png"};

Status parse_encodings(BakeSettings& b, const std::string& s) {
  b.encodings.clear();
  if (s == "none") return {};
  for (const std::string& word : words(s)) {
    if (std::find(std::begin(kEncodings), std::end(kEncodings), word) == std::end(kEncodings)) {
      std::string all = "none";
      for (const std::string_view name : kEncodings) all += ", " + std::string(name);
      return refuse(text("'{}' is not one of {}", word, all));
    }
    if (std::find(b.encodings.begin(), b.encodings.end(), word) == b.encodings.end())
      b.encodings.push_back(word);
  }
  return {};
}

Status parse_containers(BakeSettings& b, const std::string& s) {
  b.dds = b.ktx2 = false;
  for (const std::string& word : words(s)) {
    if (word != "dds" && word != "ktx2") return refuse(text("'{}' is not one of dds, ktx2, dds,ktx2", word));
    (word == "dds" ? b.dds : b.ktx2) = true;
  }
  return {};
}

Status parse_sampler(BakeSettings& b, const std::string& s) {
  KILN_TRY_STATUS(find_sampler(s));
  b.sampler = s;
  return {};
}

using B = BakeSettings;
using S = const std::string&;

const Setting kTable[] = {
    {"layout", "NAME", "",
     "atlas: use TEXCOORD_1 as one atlas of the whole scene; pack: pack charts; auto: atlas if it is valid",
     [](B& b, S s) {
       return store_word(b.layout, s, {"atlas", "pack", "auto"});
     },
     [](const B& b) { return b.layout; }},
    {"resolution", "N|WxH", "texels", "lightmap size in layout atlas", parse_resolution,
     [](const B& b) { return text("{}x{}", b.width, b.height); }},
    {"texels-per-metre", "D", "1/m", "texel density in layout pack",
     [](B& b, S s) { return store_number(b.texels_per_metre, s, 1e-4, 1e5); },
     [](const B& b) { return print(b.texels_per_metre); }},
    {"max-texels", "N", "texels",
     "texel budget of layout pack, width x height x pages: lowers the density until the pages fit; 0: none",
     [](B& b, S s) { return store_number(b.max_texels, s, 0, 2147483648.0); },
     [](const B& b) { return text("{}", b.max_texels); }},
    {"importance-box", "X,Y,Z:X,Y,Z:F", "",
     "layout pack: multiplies the density of objects touching the box by F; F below 1: only objects wholly "
     "inside",
     parse_importance_boxes, print_importance_boxes},
    {"importance-cameras", "WORD", "",
     "layout pack, on: density falls off with distance to the nearest camera in the file",
     [](B& b, S s) { return store_switch(b.importance_cameras, s); },
     [](const B& b) { return print_switch(b.importance_cameras); }},
    {"camera-distance", "M", "metres", "distance within which density is full with --importance-cameras on",
     [](B& b, S s) { return store_number(b.camera_distance, s, 1e-3, 1e6); },
     [](const B& b) { return print(b.camera_distance); }},
    {"unseen-density", "F", "",
     "density factor of objects outside every camera's view, with --importance-cameras on",
     [](B& b, S s) { return store_number(b.unseen_density, s, 1.0 / 64, 1); },
     [](const B& b) { return print(b.unseen_density); }},
    {"unseen", "WORD", "",
     "layout pack: keep: full density for every chart; auto: 2 x 2 texels for charts that no camera, light "
     "or opening reaches",
     [](B& b, S s) {
       return store_word(b.unseen, s, {"keep", "auto"});
     },
     [](const B& b) { return b.unseen; }},
    {"two-pass", "WORD", "",
     "layout pack, on: a short first pass finds charts that are black or evenly lit and gives them 2 x 2 "
     "texels",
     [](B& b, S s) { return store_switch(b.two_pass, s); },
     [](const B& b) { return print_switch(b.two_pass); }},
    {"small-objects", "M", "metres",
     "layout pack: scales down the density of objects smaller than this, in proportion to size; 0: off",
     [](B& b, S s) { return store_number(b.small_objects, s, 0, 1e6); },
     [](const B& b) { return print(b.small_objects); }},
    {"page-size", "N", "texels", "largest page side in layout pack",
     [](B& b, S s) { return store_number(b.page_size, s, 4, 16384); },
     [](const B& b) { return text("{}", b.page_size); }},
    {"power-of-two", "WORD", "", "layout pack, on: page width and height are powers of two",
     [](B& b, S s) { return store_switch(b.power_of_two, s); },
     [](const B& b) { return print_switch(b.power_of_two); }},
    {"block-align", "WORD", "", "layout pack, on: charts never share a 4x4 block of a compressed texture",
     [](B& b, S s) { return store_switch(b.block_align, s); },
     [](const B& b) { return print_switch(b.block_align); }},
    {"mip-levels", "N", "",
     "layout pack: mip levels below the first in which bilinear lookups never mix two charts",
     [](B& b, S s) { return store_number(b.mip_levels, s, 0, 8); },
     [](const B& b) { return text("{}", b.mip_levels); }},
    {"unwrap", "NAME", "",
     "layout pack: auto: unwrap meshes without a usable TEXCOORD_1; always: unwrap every mesh",
     [](B& b, S s) {
       return store_word(b.unwrap, s, {"auto", "always"});
     },
     [](const B& b) { return b.unwrap; }},
    {"unwrap-cache", "DIR|auto|off", "",
     "folder that caches unwrapped meshes; auto: $KILN_CACHE, else kiln in the user's cache folder",
     [](B& b, S s) {
       b.unwrap_cache = s;
       return s.empty() ? refuse("'' is not a folder, auto or off") : Status{};
     },
     [](const B& b) { return b.unwrap_cache; }},
    {"environment", "FILE|R,G,B", "radiance",
     "equirectangular HDR or EXR (+Y up) or a constant colour; overrides the scene's",
     [](B& b, S s) {
       b.environment = s;
       return Status{};
     },
     [](const B& b) { return b.environment; }},
    {"environment-strength", "S", "", "scale of the environment",
     [](B& b, S s) { return store_number(b.environment_strength, s, 0, 1e9); },
     [](const B& b) { return print(b.environment_strength); }},
    {"environment-rotation", "DEG", "degrees", "rotation of the environment about +Y",
     [](B& b, S s) { return store_number(b.environment_rotation, s, -36000, 36000); },
     [](const B& b) { return print(b.environment_rotation); }},
    {"sun", "X,Y,Z:R,G,B", "", "adds a directional light: direction to it, irradiance on a facing surface",
     parse_sun, print_suns},
    {"sun-angle", "DEG", "degrees", "angular diameter of directional lights; 0: a delta light",
     [](B& b, S s) { return store_number(b.sun_angle, s, 0, 90); },
     [](const B& b) { return print(b.sun_angle); }},
    {"components", "LIST", "",
     "light to bake: direct (straight from an emitter), indirect (reflected at least once)", parse_components,
     [](const B& b) {
       return std::string(b.direct ? b.indirect ? "direct,indirect" : "direct" : "indirect");
     }},
    {"split", "LIST", "",
     "direct,indirect: also write the two parts of E, irradiance.direct.exr and irradiance.indirect.exr; "
     "none",
     [](B& b, S s) {
       b.split = s == "direct,indirect" || s == "indirect,direct";
       return b.split || s == "none" ? Status{} : refuse(text("'{}' is not direct,indirect or none", s));
     },
     [](const B& b) { return std::string(b.split ? "direct,indirect" : "none"); }},
    {"max-bounces", "N", "", "maximum number of reflections between emitter and texel",
     [](B& b, S s) { return store_number(b.max_bounces, s, 0, 1e6); },
     [](const B& b) { return text("{}", b.max_bounces); }},
    {"materials", "WORD", "",
     "full: layers that keep their energy; diffuse: base colour x (1 - metallic), as in engines' bakes",
     [](B& b, S s) {
       return store_word(b.materials, s, {"full", "diffuse"});
     },
     [](const B& b) { return b.materials; }},
    {"error", "E", "",
     "relative error at --confidence to bake to, of the map as a whole or of every texel (--error-norm); "
     "0.05 or 5%",
     [](B& b, S s) { return store_share(b.error, s, 1e-6, 10); },
     [](const B& b) { return print_share(b.error); }},
    {"confidence", "C", "", "confidence level at which --error holds",
     [](B& b, S s) { return store_share(b.confidence, s, 0.01, 0.999999); },
     [](const B& b) { return print(b.confidence); }},
    {"error-norm", "WORD", "",
     "where the error target applies: max (every texel), mean-square (the map as a whole), perceptual (every "
     "texel, less in the dark)",
     [](B& b, S s) {
       return store_word(b.error_norm, s, {"max", "mean-square", "perceptual"});
     },
     [](const B& b) { return b.error_norm; }},
    {"visibility-error", "E", "", "the same bound for ao, sky and bent, as a share of full visibility",
     [](B& b, S s) { return store_number(b.visibility_error, s, 1e-6, 1); },
     [](const B& b) { return print(b.visibility_error); }},
    {"quantities", "LIST", "",
     "quantities to bake: light, ao (ambient occlusion), sky (sky visibility), bent (bent normals), probes; "
     "without light the bake samples no lights for texels; probes alone: no lightmap",
     parse_quantity_list, print_quantity_list},
    {"probes", "auto|scene|off|FILE", "",
     "probe volumes, light for what moves: auto: one around the scene; scene: those of extras.kiln.probes; a "
     "file that lists volumes",
     [](B& b, S s) {
       b.probes = s;
       return s.empty() ? refuse("'' is not auto, scene, off or a file") : Status{};
     },
     [](const B& b) { return b.probes; }},
    {"probe-spacing", "M", "metres", "--probes auto: distance of probes near surfaces",
     [](B& b, S s) { return store_number(b.probe_spacing, s, 1e-3, 1e6); },
     [](const B& b) { return print(b.probe_spacing); }},
    {"probe-max-spacing", "M", "metres", "--probes auto: distance of probes in the open; 0: the same as near",
     [](B& b, S s) { return store_number(b.probe_max_spacing, s, 0, 1e6); },
     [](const B& b) { return print(b.probe_max_spacing); }},
    {"max-probes", "N", "",
     "most probes of a bake: --probes auto raises its spacing, other volumes are refused",
     [](B& b, S s) { return store_number(b.max_probes, s, 64, 16777216); },
     [](const B& b) { return text("{}", b.max_probes); }},
    {"probe-visibility", "WORD", "",
     "on: every volume gets octahedral irradiance and distances, by which engines keep light behind walls",
     [](B& b, S s) { return store_switch(b.probe_visibility, s); },
     [](const B& b) { return print_switch(b.probe_visibility); }},
    {"probe-files", "LIST", "",
     "files of probes for engines: bevy: irradiance volumes, KTX2; textures: those that "
     "docs/shaders/kiln_probes.glsl reads, KTX2; none",
     parse_probe_files, print_probe_files},
    {"probe-dering", "WORD", "", "on: windows the harmonics of probes until E is negative nowhere",
     [](B& b, S s) { return store_switch(b.probe_dering, s); },
     [](const B& b) { return print_switch(b.probe_dering); }},
    {"ao-distance", "M", "metres", "maximum distance of occluders",
     [](B& b, S s) { return store_number(b.ao_distance, s, 1e-4, 1e6); },
     [](const B& b) { return print(b.ao_distance); }},
    {"ao-falloff", "WORD", "",
     "falloff of occlusion with distance: none (full up to --ao-distance), linear, smooth", parse_falloff,
     [](const B& b) { return std::string(falloff_name(b.ao_falloff)); }},
    {"min-samples", "N", "",
     "minimum samples per texel or probe. If not given, 16 per texel in maps of 131,072 texels or more that "
     "are baked with the irradiance cache, the denoiser and the norm mean-square",
     [](B& b, S s) { return store_number(b.min_samples, s, 1, 1 << 30); },
     [](const B& b) { return text("{}", b.min_samples); }},
    {"max-samples", "N", "",
     "maximum samples per texel; equal to min-samples: a fixed count. If not given, 16384 for probes and in "
     "the other norms than mean-square, and no bound for a bake that only time limits",
     [](B& b, S s) { return store_number(b.max_samples, s, 1, 1 << 30); },
     [](const B& b) { return text("{}", b.most_samples()); }},
    {"time-limit", "S", "seconds",
     "finish the whole bake within S seconds, or 90s, 2m, 1h30m, at the best quality possible; 0: no limit",
     [](B& b, S s) { return store_duration(b.time_limit, s, 1e9); },
     [](const B& b) { return print(b.time_limit); }},
    {"cache", "WORD", "",
     "irradiance cache, on: paths end at surfaces whose irradiance an earlier pass measured; off: exact",
     [](B& b, S s) { return store_switch(b.cache, s); }, [](const B& b) { return print_switch(b.cache); }},
    {"denoise", "WORD", "", "on: filter noise along surfaces where the measured error shows a gain",
     [](B& b, S s) { return store_switch(b.denoise, s); },
     [](const B& b) { return print_switch(b.denoise); }},
    {"basis", "NAME", "",
     "what a texel says of the light's direction: irradiance (nothing), sh_l1, sh_l2, h6, ad9, ad12, "
     "sg9 or sg12 "
     "(docs/bases.md compares them)",
     parse_basis, [](const B& b) { return b.basis; }},
    {"sh-fit", "WORD", "",
     "cap: the basis shows E itself at the surface's normal and fits normals within 60 degrees; positive: "
     "the same by "
     "lobes that are not negative (ad9, ad12, sg9, sg12); project: the projection of the light, for code "
     "that adds or "
     "convolves it",
     [](B& b, S s) {
       return store_word(b.sh_fit, s, {"cap", "positive", "project"});
     },
     [](const B& b) { return b.sh_fit; }},
    {"sh-evaluator", "WORD", "",
     "with --sh-fit cap, what engines evaluate: linear, L0 + 2 L1.n; hazel, the non-linear form",
     [](B& b, S s) {
       return store_word(b.sh_evaluator, s, {"linear", "hazel"});
     },
     [](const B& b) { return b.sh_evaluator; }},
    {"seams", "WORD", "", "on: match both sides of chart borders, within and across objects",
     [](B& b, S s) { return store_switch(b.seams, s); },
     [](const B& b) { return std::string(b.seams ? "on" : "off"); }},
    {"seam-angle", "DEG", "degrees",
     "largest angle between shading normals that is matched across a seam; sharper creases stay",
     [](B& b, S s) { return store_number(b.seam_angle, s, 0, 90); },
     [](const B& b) { return print(b.seam_angle); }},
    {"encode", "LIST", "",
     "textures for engines: bc6h, bc6h-bc1, bc6h-plain, astc-4x4|6x6|8x8, half, rgb9e5, rgbe, rgbm, rgbd, "
     "exr, "
     "hdr, png; none",
     parse_encodings,
     [](const B& b) { return b.encodings.empty() ? std::string("none") : joined(b.encodings); }},
    {"container", "LIST", "", "file formats of block-compressed and float textures: dds, ktx2",
     parse_containers, [](const B& b) { return std::string(b.dds ? b.ktx2 ? "dds,ktx2" : "dds" : "ktx2"); }},
    {"encode-effort", "NAME", "", "fast, normal or best: trades compression time for error",
     [](B& b, S s) {
       return store_word(b.encode_effort, s, {"fast", "normal", "best"});
     },
     [](const B& b) { return b.encode_effort; }},
    {"encode-metric", "NAME", "", "error that compression minimises: linear, log or perceptual",
     [](B& b, S s) {
       return store_word(b.encode_metric, s, {"linear", "log", "perceptual"});
     },
     [](const B& b) { return b.encode_metric; }},
    {"max-encode-error", "E", "",
     "largest rms relative error of decoded textures. auto: half of the reported error, at least 0.01, by "
     "raising "
     "the effort and, where --encode is not given, by a format with more bits; a number: by raising the "
     "effort, "
     "else the bake fails; 0: no bound",
     [](B& b, S s) {
       if (s != "auto") return store_share(b.max_encode_error, s, 0, 10);
       b.max_encode_error = kAutoBound;
       return Status{};
     },
     [](const B& b) {
       return b.max_encode_error == kAutoBound ? std::string("auto") : print_share(b.max_encode_error);
     }},
    {"encode-quantity", "NAME", "",
     "basis: encode the basis; irradiance: encode E at the surface normal; both",
     [](B& b, S s) {
       return store_word(b.encode_quantity, s, {"basis", "irradiance", "both"});
     },
     [](const B& b) { return b.encode_quantity; }},
    {"encode-units", "NAME", "",
     "textures of E store e: E itself; e-over-pi: E/pi, the factor of base colour",
     [](B& b, S s) {
       return store_word(b.encode_units, s, {"e", "e-over-pi"});
     },
     [](const B& b) { return b.encode_units; }},
    {"encode-range", "NAME", "",
     "range of L1/L0: unit: stores [-1, 1] as [0, 1]; fit: stores the range in use, in finer steps",
     [](B& b, S s) {
       return store_word(b.encode_range, s, {"unit", "fit"});
     },
     [](const B& b) { return b.encode_range; }},
    {"ktx2-zstd", "N", "", "Zstandard level of KTX2 files; 0: uncompressed",
     [](B& b, S s) { return store_number(b.ktx2_zstd, s, 0, 19); },
     [](const B& b) { return text("{}", b.ktx2_zstd); }},
    {"dilate", "N", "texels", "distance to extend colours into empty texels",
     [](B& b, S s) { return store_number(b.dilate, s, 0, 64); },
     [](const B& b) { return text("{}", b.dilate); }},
    {"workers", "N", "", "worker processes on this machine; 0: one",
     [](B& b, S s) { return store_number(b.workers, s, 0, 256); },
     [](const B& b) { return text("{}", b.workers); }},
    {"threads", "N", "", "threads per worker; 0: processors divided among the workers",
     [](B& b, S s) { return store_number(b.threads, s, 0, 1024); },
     [](const B& b) { return text("{}", b.threads); }},
    {"tile-texels", "N", "texels", "texels per unit of work; does not change the result",
     [](B& b, S s) { return store_number(b.tile_texels, s, 1, 65536); },
     [](const B& b) { return text("{}", b.tile_texels); }},
    {"seed", "N", "", "seed of all random numbers",
     [](B& b, S s) { return store_number(b.seed, s, 0, 9007199254740992.0); },
     [](const B& b) { return text("{}", b.seed); }},
    {"contact-cuts", "WORD", "",
     "layout pack, on: cut charts where a wall stands on them, so that no texel mixes light from both sides",
     [](B& b, S s) { return store_switch(b.contact_cuts, s); },
     [](const B& b) { return print_switch(b.contact_cuts); }},
    {"variant", "NAME", "",
     "variant of KHR_materials_variants whose materials are baked; empty: the materials that the file itself "
     "names",
     [](B& b, S s) {
       b.variant = s;
       return Status{};
     },
     [](const B& b) { return b.variant; }},
    {"lod", "N", "", "MSFT_lod level to bake, 0 is the finest; the other levels use its lightmap",
     [](B& b, S s) { return store_number(b.lod, s, 0, 64); }, [](const B& b) { return text("{}", b.lod); }},
    {"lod-distance", "D", "metres",
     "largest distance of other levels, and of meshes a proxy stands for, from the baked surface; 0: 5 % of "
     "its size",
     [](B& b, S s) { return store_number(b.lod_distance, s, 0, 1e9); },
     [](const B& b) { return print(b.lod_distance); }},
    {"lod-split", "N", "texels",
     "split triangles of other levels until corners and midpoints look up within N texels; 0: never",
     [](B& b, S s) { return store_number(b.lod_split, s, 0, 1e6); },
     [](const B& b) { return print(b.lod_split); }},
    {"keep-layout", "FILE", "",
     "layout pack: charts.json of an earlier bake; unchanged charts keep their place",
     [](B& b, S s) {
       b.keep_layout = s;
       return s.empty() ? refuse("'' is not a file") : Status{};
     },
     [](const B& b) { return b.keep_layout; }},
    {"instanced", "WORD", "",
     "layout pack, on: also write scene_instanced.glb, each mesh stored once, for engines that read "
     "charts.bin",
     [](B& b, S s) { return store_switch(b.instanced, s); },
     [](const B& b) { return print_switch(b.instanced); }},
    {"gltf-lightmap", "LIST", "",
     "how scene.glb describes the lightmap: kiln (KILN_lightmap, all of it), moz (MOZ_lightmap on materials, "
     "8 bits), epic (EPIC_lightmap_textures on nodes, 8 bits), mx (MX_lightmap on nodes, RGBM), or none",
     parse_gltf_lightmaps, print_gltf_lightmaps},
    {"embed-basecolor", "WORD", "",
     "on: also write scene_unlit.glb, light baked into base-colour textures, for any viewer",
     [](B& b, S s) { return store_switch(b.embed_basecolor, s); },
     [](const B& b) { return print_switch(b.embed_basecolor); }},
    {"lamps", "WORD", "",
     "lamps and sky whose light is in the map, in scene.glb: drop: left out, so that no viewer lights twice; "
     "mark: kept, with extras.kiln.baked; keep: as they are",
     [](B& b, S s) {
       return store_word(b.lamps, s, {"drop", "keep", "mark"});
     },
     [](const B& b) { return b.lamps; }},
    {"sampler", "NAME", "", "random numbers: owen (scrambled Sobol'), halton, pmj02 or random", parse_sampler,
     [](const B& b) { return b.sampler; }},
    {"watertight", "WORD", "",
     "on: no ray slips between triangles that share an edge (otherwise a few in a million do); up to a fifth "
     "slower",
     [](B& b, S s) { return store_switch(b.watertight, s); },
     [](const B& b) { return print_switch(b.watertight); }},
    {"preview", "on|off|WxH", "pixels", "pictures in the report and their size; off: none", parse_preview,
     print_preview},
    {"camera", "NAME|X,Y,Z:X,Y,Z[:FOV]", "",
     "viewpoint of pictures: a camera of the file, or position, target and vertical field of view in "
     "degrees; empty: the file's first camera that shows something, else chosen automatically",
     [](B& b, S s) {
       b.camera = s;
       return Status{};
     },
     [](const B& b) { return b.camera; }},
    {"isa", "NAME", "", "numeric class: the instruction set of Embree's kernels",
     [](B& b, S s) {
       return store_word(b.isa, s, {"sse2", "sse4.2", "avx", "avx2", "avx512"});
     },
     [](const B& b) { return b.isa; }},
    {"lease-ms", "MS", "milliseconds", "a worker silent for this long loses its units to others",
     [](B& b, S s) { return store_number(b.lease_ms, s, 200, 3600000); },
     [](const B& b) { return text("{}", b.lease_ms); }},
};

}  // namespace

std::span<const Setting> settings_table() {
  return kTable;
}

std::span<const std::string_view> encoding_names() {
  return kEncodings;
}

}  // namespace kiln
