// The albedos of docs/materials.md: KILN_WRITE_DOCS=1 rewrites the page, the normal run holds it against what
// the closures give. And the numbers of the sheen layer against its lobe.
#include <cstdlib>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/math/sequence.h"
#include "tests/materials/roster.h"
#include "tests/support/paths.h"
#include "worker/materials/sheen.h"

namespace kiln {
namespace {

constexpr float kCosines[] = {1.0f, 0.7f, 0.4f, 0.2f, 0.1f, 0.03f};

std::string page() {
  std::string out = R"(# Albedo of materials

What a white material gives back of a radiance of 1 from everywhere (base colour 1, or the largest channel), by
roughness of all its layers and by the cosine of the view to the normal. Nothing is lost and nothing gained: what
differs from 1 is the table of the layers' albedo (0.0012, `worker/materials/ggx_albedo.h`) and the sum of 32,768
samples. One pair of layers is the exception: sheen over a GGX layer lets through what the more grazing direction
leaves, and the light between the two is lost. So does a smooth pane at grazing angles: it lets 1 - F through, and its
lobe, whose alpha is 0.02 at least, reflects less than F. Written by `KILN_WRITE_DOCS=1 build/bin/materials_test
--gtest_filter='Table.*'`; the test holds the page against the closures.

| material | roughness |)";
  for (const float cos : kCosines) out += text(" {:g} |", cos);
  out += "\n|---|---|---|---|---|---|---|---|\n";
  for (const double roughness : {0.0, 0.3, 0.6, 1.0})
    for (const auto& m : test::layered_materials(roughness, 1)) {
      out += text("| {} | {:g} |", m.name, roughness);
      for (const float cos : kCosines) out += text(" {:.3f} |", test::white_furnace(m.bsdf, cos, 1u << 15));
      out += "\n";
    }
  return out;
}

TEST(Table, OfAlbedosIsWhatTheClosuresGive) {
  const auto path = test::source_dir() / "docs" / "materials.md";
  const std::string now = page();
  if (std::getenv("KILN_WRITE_DOCS")) ASSERT_TRUE(write_file_atomic(path, now));
  const auto file = read_file(path);
  ASSERT_TRUE(file.has_value());
  EXPECT_EQ(std::string(reinterpret_cast<const char*>(file->data()), file->size()), now);
}

// The lobe of KHR_materials_sheen as its text has it, in double: D of Charlie, masking by the fitted Lambda.
double lambda_term(double x, double a) {
  const double o = (1 - a) * (1 - a);
  const auto mix = [&](double p, double q) { return p + (q - p) * o; };
  return mix(21.5473, 25.3245) / (1 + mix(3.82987, 3.32435) * std::pow(x, mix(0.19823, 0.16801))) +
         mix(-1.97760, -1.27393) * x + mix(-4.32054, -4.85967);
}
double lambda(double cos, double a) {
  return cos < 0.5 ? std::exp(lambda_term(cos, a))
                   : std::exp(2 * lambda_term(0.5, a) - lambda_term(1 - cos, a));
}
double charlie_albedo(double cos, double roughness) {
  const double a = std::pow(std::max(roughness, 0.07), 2), so = std::sqrt(1 - cos * cos);
  const int n = 400;
  double sum = 0;
  for (int i = 0; i < n; ++i)
    for (int k = 0; k < n; ++k) {
      const double t = (i + 0.5) / n, mi = t * t, phi = M_PI * (k + 0.5) / n, si = std::sqrt(1 - mi * mi);
      const double x = so + si * std::cos(phi), y = si * std::sin(phi), z = cos + mi;
      const double sin2 = std::max(0.0, 1 - z * z / (x * x + y * y + z * z));
      const double d = (2 + 1 / a) * std::pow(sin2, 1 / (2 * a)) / (2 * M_PI);
      const double v = std::min(1.0, 1 / ((1 + lambda(cos, a) + lambda(mi, a)) * 4 * cos * mi));
      sum += d * v * mi * 2 * t;
    }
  return sum / n / n * 2 * M_PI;
}

TEST(Sheen, AlbedosAreThoseOfCharliesLobe) {
  for (int row = 0; row <= 8; ++row)
    for (int column = 1; column <= 8; ++column) {
      const double cos = column * column / 64.0;
      // Four digits were kept; the quadrature here is coarser than that which made them.
      EXPECT_NEAR(SheenAlbedo(static_cast<float>(row / 8.0)).at(static_cast<float>(cos)),
                  std::min(1.0, charlie_albedo(cos, row / 8.0)), 4e-4)
          << row << " " << column;
    }
}

}  // namespace
}  // namespace kiln
