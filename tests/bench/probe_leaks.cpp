// Prints the leak table of docs/probes.md: probe_leaks [offsets], or one row: probe_leaks OFFSETS WALL
// SPACING.
#include <cstdio>
#include <cstdlib>

#include "tests/probes/two_rooms.h"

int main(int argc, char** argv) {
  using namespace kiln;
  const int offsets = argc > 1 ? std::atoi(argv[1]) : 16;
  constexpr int kPoints = 1500;
  constexpr uint32_t kSamples = 128;
  std::printf(
      "| wall | spacing | mean | p99 | without visibility: mean | p99 |\n|---|---|---|---|---|---|\n");
  const auto row = [&](double wall, double spacing) {
    ProbeQuery blind;
    blind.visibility = false;
    const auto w = static_cast<float>(wall);
    const test::Leak seeing = test::leak_of(w, spacing, offsets, kPoints, kSamples, {});
    const test::Leak unseeing = test::leak_of(w, spacing, offsets, kPoints, kSamples, blind);
    std::printf("| %g cm | %g m | %.4f %% | %.3f %% | %.2f %% | %.1f %% |\n", 100 * wall, spacing,
                100 * seeing.mean, 100 * seeing.p99, 100 * unseeing.mean, 100 * unseeing.p99);
    std::fflush(stdout);
  };
  if (argc > 3) {
    row(std::atof(argv[2]), std::atof(argv[3]));
    return 0;
  }
  row(0.2, 1);
  for (const double wall : {0.1, 0.05, 0.02})
    for (const double spacing : {1.0, 0.5}) row(wall, spacing);
}
