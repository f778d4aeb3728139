#include "coordinator/output/textures/encodings.h"

#include "common/base/check.h"

namespace kiln {
namespace {

using F = TextureFormat;
using U = Unpack;
constexpr FileKind kTexture = FileKind::kTexture, kPng = FileKind::kPng;

using Formats = Encoding::ResponseFormats;
constexpr Formats kBlocks{F::kBc4Unorm, F::kBc7Unorm};
constexpr Formats kAstc4x4{F::kAstc4x4Unorm, F::kAstc4x4Unorm};
constexpr Formats kAstc6x6{F::kAstc6x6Unorm, F::kAstc6x6Unorm};
constexpr Formats kAstc8x8{F::kAstc8x8Unorm, F::kAstc8x8Unorm};
constexpr Formats kHalves{F::kRgba16Float, F::kRgba16Float};
constexpr Formats kBytes{F::kRgba8Unorm, F::kRgba8Unorm};

constexpr Encoding kRoster[] = {
    {"bc6h", "L0 in BC6H, L1/L0 in BC7: 32 bits a texel", kTexture, F::kBc6hUfloat, U::kNone, F::kBc7Unorm,
     true, true, true, kBlocks, "bc6h-plain"},
    {"bc6h-bc1", "L0 in BC6H, L1/L0 in BC1: 20 bits a texel", kTexture, F::kBc6hUfloat, U::kNone,
     F::kBc1Unorm, true, true, true, kBlocks, "bc6h"},
    {"bc6h-plain", "L0 and L1 in BC6H: 32 bits a texel, filtered without error", kTexture, F::kBc6hUfloat,
     U::kNone, F::kBc6hSfloat, false, true, true, kBlocks, "rgb9e5"},
    {"astc-4x4", "L0 in ASTC HDR, L1/L0 in ASTC LDR: 32 bits a texel", kTexture, F::kAstc4x4Sfloat, U::kNone,
     F::kAstc4x4Unorm, true, false, true, kAstc4x4, "rgb9e5"},
    {"astc-6x6", "the same, 14.2 bits a texel", kTexture, F::kAstc6x6Sfloat, U::kNone, F::kAstc6x6Unorm, true,
     false, true, kAstc6x6, "astc-4x4"},
    {"astc-8x8", "the same, 8 bits a texel", kTexture, F::kAstc8x8Sfloat, U::kNone, F::kAstc8x8Unorm, true,
     false, true, kAstc8x8, "astc-6x6"},
    {"half", "16-bit floats, uncompressed: 256 bits a texel", kTexture, F::kRgba16Float, U::kNone,
     F::kRgba16Float, false, true, true, kHalves},
    {"rgb9e5", "L0 with a shared exponent, L1/L0 in 8 bits: 128 bits a texel", kTexture, F::kRgb9e5, U::kNone,
     F::kRgba8Unorm, true, true, true, kBytes, "half"},
    {"rgbe", "8-bit PNG, Ward's RGBE; not to be filtered before it is unpacked", kPng, F::kRgba8Unorm,
     U::kRgbe, F::kRgba8Unorm, true, false, true, kBytes},
    {"rgbm", "8-bit PNG, (8 a c)^2", kPng, F::kRgba8Unorm, U::kRgbm, F::kRgba8Unorm, true, false, true,
     kBytes},
    {"rgbd", "8-bit PNG, c^2.2 / a", kPng, F::kRgba8Unorm, U::kRgbd, F::kRgba8Unorm, true, false, true,
     kBytes},
    {"exr",
     "16-bit EXR, all planes in one file",
     FileKind::kExr,
     F::kRgba16Float,
     U::kNone,
     F::kRgba16Float,
     false,
     false,
     true,
     {}},
    {"png", "8-bit PNG of E, sRGB; hardware decodes it before it filters", kPng, F::kRgba8Unorm, U::kSrgb,
     F::kRgba8Unorm, true, false, false, kBytes},
    {"hdr",
     "Radiance HDR of E",
     FileKind::kHdr,
     F::kRgba8Unorm,
     U::kRgbe,
     F::kRgba8Unorm,
     true,
     false,
     false,
     {}},
};

std::array<std::string, 3> channels_of(const std::string& function) {
  return {function + ".R", function + ".G", function + ".B"};
}

// The format of light that may be negative, for functions that are ratios of none.
std::optional<TextureFormat> with_sign(TextureFormat light) {
  if (light == F::kBc6hUfloat) return F::kBc6hSfloat;
  if (light == F::kRgba16Float) return light;
  return std::nullopt;
}

bool is_lobe_of_both_signs(const BasisInfo& basis, size_t function) {
  return basis.is_signed[function] && !basis.has_base;
}

}  // namespace

std::span<const Encoding> encoding_roster() {
  return kRoster;
}

const Encoding& encoding(std::string_view name) {
  for (const Encoding& e : kRoster)
    if (e.name == name) return e;
  KILN_CHECK(!"encoding exists");
  return kRoster[0];
}

std::vector<TextureLayout> layouts_of(const Encoding& e, const BasisInfo& basis, Quantity quantity) {
  std::vector<TextureLayout> out;
  if (quantity == Quantity::kIrradiance || basis.functions.empty()) {
    out.push_back({"E", channels_of("E"), {}, e.light, e.unpack, false, channels_of("E")});
    return out;
  }
  const std::string base = basis.has_base ? std::string(basis.functions[0]) : "E";
  for (size_t f = 0; f < basis.functions.size(); ++f) {
    const std::string function(basis.functions[f]);
    if (!basis.is_signed[f]) {
      out.push_back({function, channels_of(function), {}, e.light, e.unpack, false, channels_of(base)});
      continue;
    }
    TextureLayout t{function, channels_of(function), {}, e.direction, Unpack::kNone, true, channels_of(base)};
    if (is_lobe_of_both_signs(basis, f))
      t.format = with_sign(e.light).value_or(e.direction);
    else if (e.ratio)
      t.times = channels_of(base);
    out.push_back(std::move(t));
  }
  return out;
}

bool holds(const Encoding& e, const BasisInfo& basis) {
  for (size_t f = 0; f < basis.functions.size(); ++f)
    if (e.directional && is_lobe_of_both_signs(basis, f) && !with_sign(e.light)) return false;
  return true;
}

}  // namespace kiln
