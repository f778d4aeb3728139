#include "coordinator/output/textures/radiance.h"

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {
namespace {

constexpr size_t kMaxRun = 127, kMaxLiteral = 128, kMinRun = 4;

size_t run_length(std::span<const std::byte> line, size_t at) {
  size_t n = 1;
  while (at + n < line.size() && n < kMaxRun && line[at + n] == line[at]) ++n;
  return n;
}

// One channel of a scan line: (128 + n, byte) for n equal bytes, (n, bytes ...) for others.
void pack_line(std::span<const std::byte> line, Bytes& out) {
  for (size_t at = 0; at < line.size();) {
    if (const size_t run = run_length(line, at); run >= kMinRun) {
      out.push_back(static_cast<std::byte>(128 + run));
      out.push_back(line[at]);
      at += run;
      continue;
    }
    size_t end = at + 1;
    while (end < line.size() && end - at < kMaxLiteral && run_length(line, end) < kMinRun) ++end;
    out.push_back(static_cast<std::byte>(end - at));
    out.insert(out.end(), line.begin() + static_cast<ptrdiff_t>(at),
               line.begin() + static_cast<ptrdiff_t>(end));
    at = end;
  }
}

}  // namespace

Bytes write_radiance(uint32_t width, uint32_t height, std::span<const std::byte> rgbe) {
  KILN_CHECK(rgbe.size() == 4 * size_t{width} * height);
  const std::string head =
      text("#?RADIANCE\nSOFTWARE=Kiln\nFORMAT=32-bit_rle_rgbe\n\n-Y {} +X {}\n", height, width);
  Bytes out;
  for (const char c : head) out.push_back(static_cast<std::byte>(c));
  if (width < 8 || width > 0x7FFF) {  // run-length coding excludes these widths
    out.insert(out.end(), rgbe.begin(), rgbe.end());
    return out;
  }
  std::vector<std::byte> line(width);
  for (size_t y = 0; y < height; ++y) {
    for (const unsigned byte : {2u, 2u, width >> 8, width & 255}) out.push_back(static_cast<std::byte>(byte));
    for (size_t channel = 0; channel < 4; ++channel) {
      for (size_t x = 0; x < width; ++x) line[x] = rgbe[4 * (y * width + x) + channel];
      pack_line(line, out);
    }
  }
  return out;
}

}  // namespace kiln
