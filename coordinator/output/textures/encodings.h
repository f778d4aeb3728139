// ROOM: add an encoding. The encodings of --encode: how planes are laid out in textures and which formats
// store them. One line in the roster here and its name in common/job.
#pragma once

#include <array>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/responses/basis.h"
#include "coordinator/output/container/texture_format.h"
#include "coordinator/output/textures/pixel_codes.h"

namespace kiln {

enum class FileKind : uint8_t {
  kTexture,  // DDS and KTX2: pages are layers, mips are levels
  kPng,      // one file per texture and page
  kHdr,      // one file a page
  kExr,      // one file a page with all planes
};

struct Encoding {
  std::string_view name;
  std::string_view about;
  FileKind files;
  TextureFormat light;      // of L0 and E
  Unpack unpack;            // of those
  TextureFormat direction;  // of L1
  bool ratio;               // L1/L0 in [0, 1] (O'Donnell 2018, "Encoding"); else L1 as it is
  bool dds;                 // the format has a DXGI number
  bool directional;         // else stores E only
  struct ResponseFormats {
    TextureFormat scalar, vector;
  };
  std::optional<ResponseFormats> responses;  // for ao, sky, bent; empty: masters only
  // The encoding for the same engines to try next where this one has too much error; empty: none.
  std::string_view finer{};
};

std::span<const Encoding> encoding_roster();
const Encoding& encoding(std::string_view name);  // one of encoding_names()

// The layout of one texture.
struct TextureLayout {
  std::string name;                  // "L0", "L1x", "E"
  std::array<std::string, 3> plane;  // of R, G, B
  std::array<std::string, 3> times;  // denominators of ratios; empty: plain values
  TextureFormat format;
  Unpack unpack = Unpack::kNone;
  bool is_signed = false;              // values may be negative
  std::array<std::string, 3> light{};  // planes that errors are relative to
  bool is_ratio() const { return !times[0].empty(); }
};

// The stored quantity: the basis' planes, or E at the surface normal.
enum class Quantity : uint8_t { kBasis, kIrradiance };
std::vector<TextureLayout> layouts_of(const Encoding& encoding, const BasisInfo& basis, Quantity quantity);
// Whether its formats hold the basis: not those without a sign for lobes of both signs.
bool holds(const Encoding& encoding, const BasisInfo& basis);

}  // namespace kiln
