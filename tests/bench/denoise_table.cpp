// What the denoiser makes of bakes of generated scenes:
//   denoise_table [folder]
// For each scene and number of samples: mean squared relative error before and after, against a reference of
// 2 x 2048 samples (whose own noise is taken off), how many times the samples that is worth, and the ratio of
// true to stated squared error. With a folder: pictures of the pages.
#include <chrono>
#include <filesystem>

#include "common/base/format.h"
#include "coordinator/bake/denoise/denoise.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/denoise/replicates.h"
#include "tests/denoise/scenes.h"
#include "tests/leaks/leak_scenes.h"
#include "tests/seams/baked_room.h"

namespace kiln::test {
namespace {

// Texels below a thirtieth of the mean count as if they had it: a 2 cm gap under a box is nothing to look at.
constexpr double kDark = 1.0 / 30;

struct Errors {
  double raw = 0, denoised = 0;     // mean squared relative error
  double raw_ratio = 0, ratio = 0;  // mean of squared true error / stated^2
  double raw_sum = 0, sum = 0;      // relative error of the sum over all texels
};

Errors errors_of(const TexelStatistics& s, const Denoised& d, const TexelStatistics& reference) {
  Errors e;
  double mean = 0, count = 0, light = 0;
  for (size_t i = 0; i < s.sites; ++i) mean += reference.luminance[0][i] / static_cast<double>(s.sites);
  for (size_t i = 0; i < s.sites; ++i) {
    const double a = reference.luminance[0][i], b = reference.luminance[1][i], t = (a + b) / 2;
    if (!s.known[i] || !reference.known[i] || t <= 0) continue;
    const double noise = (a - b) * (a - b) / 4, unit = t * t + kDark * kDark * mean * mean;
    const double raw = (double{s.luminance[0][i]} + s.luminance[1][i]) / 2 - t, after = d.luminance[i] - t;
    e.raw += (raw * raw - noise) / unit;
    e.denoised += (after * after - noise) / unit;
    e.raw_ratio += (raw * raw - noise) / (double{d.raw_error[i]} * d.raw_error[i] + 1e-30);
    e.ratio += (after * after - noise) / (double{d.standard_error[i]} * d.standard_error[i] + 1e-30);
    e.raw_sum += raw;
    e.sum += after;
    light += t;
    count += 1;
  }
  for (double* v : {&e.raw, &e.denoised, &e.raw_ratio, &e.ratio}) *v /= count;
  e.raw_sum /= light;
  e.sum /= light;
  return e;
}

// All pages, the luminance of E at 2 `unit` white, sRGB's gamma.
void write_picture(const ReplicateBake& b, const std::vector<float>& value, double unit,
                   const std::filesystem::path& path) {
  std::vector<uint8_t> texels(b.atlas.texel_count() * 3);
  for (size_t i = 0; i < value.size(); ++i) {
    const double v = std::clamp(value[i] / (2 * unit), 0.0, 1.0);
    const auto grey = static_cast<uint8_t>(std::lround(255 * std::pow(v, 1 / 2.2)));
    std::fill_n(&texels[size_t{b.atlas.sites.texel[i]} * 3], 3, grey);
  }
  if (const Status s = write_png(path, b.atlas.width, b.atlas.height * b.atlas.pages, texels); !s)
    throw std::runtime_error(s.error().message);
}

void write_pictures(const ReplicateBake& b, const TexelStatistics& s, const Denoised& d,
                    const TexelStatistics& reference, const std::string& stem) {
  std::vector<float> raw(s.sites), truth(s.sites);
  double mean = 0;
  for (size_t i = 0; i < s.sites; ++i) {
    raw[i] = (s.luminance[0][i] + s.luminance[1][i]) / 2;
    truth[i] = (reference.luminance[0][i] + reference.luminance[1][i]) / 2;
    mean += truth[i] / static_cast<double>(s.sites);
  }
  write_picture(b, raw, mean, stem + "_raw.png");
  write_picture(b, d.luminance, mean, stem + "_denoised.png");
  write_picture(b, truth, mean, stem + "_reference.png");
  write_picture(b, d.strength, 0.5, stem + "_strength.png");
}

void print_rows(const char* name, const Scene& scene, const std::filesystem::path& folder) {
  const ReplicateBake b = bake_replicates(scene, 8, 16);
  const TexelStatistics reference = statistics_of(b, 2048, 99);
  const DirectionBound bounds[3] = {{3, {6, 9, 12}}, {4, {7, 10, 13}}, {5, {8, 11, 14}}};
  for (const uint32_t samples : {16u, 64u, 256u}) {
    const TexelStatistics s = statistics_of(b, samples, samples);
    const auto start = std::chrono::steady_clock::now();
    const Denoised d = denoise(s, bounds, b.sites, b.links, 1);
    const std::chrono::duration<double> seconds = std::chrono::steady_clock::now() - start;
    const Errors e = errors_of(s, d, reference);
    std::fputs(text("| {} | {} | {} | {:.2e} | {:.2e} | {:.1f} | {:.2f} | {:.2f} | {:+.2f} % | {:+.2f} % | "
                    "{:.1f} |\n",
                    name, s.sites, 2 * samples, e.raw, e.denoised, e.raw / e.denoised, e.raw_ratio, e.ratio,
                    100 * e.raw_sum, 100 * e.sum, 1e6 * seconds.count() / static_cast<double>(s.sites))
                   .c_str(),
               stdout);
    std::fflush(stdout);
    if (!folder.empty())
      write_pictures(b, s, d, reference, (folder / text("{}_{}", name, 2 * samples)).string());
  }
}

}  // namespace
}  // namespace kiln::test

int main(int argc, char** argv) {
  using namespace kiln::test;
  const std::filesystem::path folder = argc > 1 ? argv[1] : "";
  std::puts(
      "| scene | texels | samples | relMSE | denoised | samples' worth | true / stated^2 | denoised | sum | "
      "denoised | us a texel |\n|---|---|---|---|---|---|---|---|---|---|---|");
  print_rows("lamp room", lamp_room_scene(), folder);
  print_rows("two rooms", two_rooms(0.1f).maker.take(), folder);
  print_rows("table in the sun", closed_table().maker.take(), folder);
  print_rows("wall and boxes", room_scene(), folder);
}
