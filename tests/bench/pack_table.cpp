// Packing: time and efficiency. Prints Markdown tables for docs/packing.md, on one thread.
//   build/bin/pack_table [--svg FILE]
#include <sys/resource.h>

#include <cmath>
#include <cstdio>
#include <cstring>
#include <ctime>
#include <numeric>

#include "common/base/files.h"
#include "common/base/format.h"
#include "tests/bench/plain_sweep.h"
#include "tests/pack/level.h"

namespace kiln {
namespace {
using namespace test;

constexpr uint32_t kPage = 16384;

double processor_seconds() {
  timespec t{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
  return static_cast<double>(t.tv_sec) + 1e-9 * static_cast<double>(t.tv_nsec);
}

double peak_megabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024;
}

uint64_t bits_of(const MaskSet& masks) {
  uint64_t bits = 0;
  for (uint32_t i = 0; i < masks.size(); ++i) bits += masks[i].count();
  return bits;
}

MaskSet blocks_of(const MaskSet& masks) {
  MaskSet blocks;
  for (uint32_t i = 0; i < masks.size(); ++i) blocks.add_reduced(masks[i], 4);
  return blocks;
}

struct Measured {
  PackResult result;
  double seconds;
  double share(uint64_t texels) const {
    return 100.0 * static_cast<double>(texels) / (double{1.0} * result.width * result.height * result.pages);
  }
};

template <class Pack>
Measured measure(const Pack& pack) {
  const double start = processor_seconds();
  PackResult result = pack();
  return {std::move(result), processor_seconds() - start};
}

Measured ours(const MaskSet& masks, const PackSettings& settings) {
  std::vector<uint32_t> items(masks.size());
  std::iota(items.begin(), items.end(), 0u);
  return measure([&] { return pack_masks(masks, items, settings); });
}

void row(const char* what, const Measured& m, uint64_t texels) {
  std::printf("| %s | %u x %u x %u | %.2f %% | %.2f s |\n", what, m.result.width, m.result.height,
              m.result.pages, m.share(texels), m.seconds);
  std::fflush(stdout);
}

void published_table() {
  const double before = peak_megabytes();
  const double start = processor_seconds();
  const MaskSet masks = make_level(published_level(), 263000, 1);
  const double made = processor_seconds() - start;
  const uint64_t texels = bits_of(masks);
  uint32_t tiny = 0;
  for (uint32_t i = 0; i < masks.size(); ++i) tiny += std::max(masks[i].width, masks[i].height) <= 6;
  const double with_masks = peak_megabytes();
  const Measured whole = ours(masks, {.max_page_size = kPage});
  const double peak = peak_megabytes();
  std::printf(
      "%u charts, %.0f %% of them 6 texels or less a side, %.2f million texels; masks rasterised in %.2f s.\n"
      "Peak memory: %.1f MB for the masks, %.1f MB more while packing.\n\n",
      masks.size(), 100.0 * tiny / masks.size(), static_cast<double>(texels) / 1e6, made, with_masks - before,
      peak - with_masks);
  std::printf("| | size | used | time |\n|---|---|---|---|\n");
  row("as it is", whole, texels);
  row("not turned", ours(masks, {.max_page_size = kPage, .turn = false}), texels);
  row("pages of at most 1024", ours(masks, {.max_page_size = 1024}), texels);
  row("powers of two, at most 1024", ours(masks, {.max_page_size = 1024, .power_of_two = true}), texels);
  const MaskSet blocks = blocks_of(masks);
  const Measured aligned = ours(blocks, {.max_page_size = kPage, .cell = 4});
  row("4x4 blocks", aligned, texels);
  row("4x4 blocks, counting whole blocks", aligned, 16 * bits_of(blocks));
  const bool same = whole.result.places == ours(masks, {.max_page_size = kPage}).result.places;
  std::printf("\nPacked twice: %s.\n\n", same ? "the same places" : "OTHER PLACES");
}

void mixes_table() {
  const uint32_t counts[] = {20000, 2000, 150, 2000, 8000};
  std::printf(
      "| mix | charts | texels | plain: used | time | ours: used | time | not turned: used | time "
      "| 4x4 blocks: used | of the blocks | time |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n");
  for (size_t k = 0; k < mixes().size(); ++k) {
    const MaskSet masks = make_level(mixes()[k], counts[k], 1), blocks = blocks_of(masks);
    const uint64_t texels = bits_of(masks);
    const auto side = static_cast<uint32_t>(std::ceil(std::sqrt(static_cast<double>(texels) / 0.97)));
    const Measured plain = measure([&] { return bench::plain_sweep(masks, (side + 3) / 4 * 4); });
    const Measured mine = ours(masks, {.max_page_size = kPage});
    const Measured upright = ours(masks, {.max_page_size = kPage, .turn = false});
    const Measured aligned = ours(blocks, {.max_page_size = kPage, .cell = 4});
    std::printf(
        "| %s | %u | %.2f M | %.1f %% | %.2f s | %.1f %% | %.2f s | %.1f %% | %.2f s | %.1f %% | %.1f %% "
        "| %.2f s |\n",
        mixes()[k].name.c_str(), counts[k], static_cast<double>(texels) / 1e6, plain.share(texels),
        plain.seconds, mine.share(texels), mine.seconds, upright.share(texels), upright.seconds,
        aligned.share(texels), aligned.share(16 * bits_of(blocks)), aligned.seconds);
    std::fflush(stdout);
  }
}

// Runs of texels of one chart as rectangles, a colour for each chart.
std::string picture(const MaskSet& masks, const PackResult& r) {
  std::string svg = text(
      "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 {} {}\" width=\"{}\" height=\"{}\" "
      "shape-rendering=\"crispEdges\">\n<rect width=\"100%\" height=\"100%\"/>\n",
      r.width, r.height, 2 * r.width, 2 * r.height);
  for (uint32_t i = 0; i < masks.size(); ++i) {
    const PackPlace& place = r.places[i];
    MaskSet turned;
    if (place.turned) turned.add_turned(masks[i]);
    const MaskView mask = place.turned ? turned[0] : masks[i];
    svg +=
        text("<path fill=\"hsl({},{}%,{}%)\" d=\"", i * 137 % 360, place.turned ? 75 : 45, 40 + i * 29 % 35);
    for (uint32_t y = 0; y < mask.height; ++y)
      for (uint32_t x = 0; x < mask.width; ++x) {
        if (!mask.get(x, y)) continue;
        const uint32_t first = x;
        while (x < mask.width && mask.get(x, y)) ++x;
        svg += text("M{} {}h{}v1h-{}z", place.x + first, place.y + y, x - first, x - first);
      }
    svg += "\"/>\n";
  }
  return svg + "</svg>\n";
}

int run(int argc, char** argv) {
  if (argc == 3 && !std::strcmp(argv[1], "--svg")) {
    const MaskSet masks = make_level({"picture", 3, 90, 1.0, 0.2}, 500, 3);
    const std::string svg = picture(masks, ours(masks, {.max_page_size = kPage}).result);
    if (Status s = write_file_atomic(argv[2], svg); !s) {
      std::fprintf(stderr, "%s\n", s.error().message.c_str());
      return 1;
    }
  } else if (argc != 1) {
    std::fprintf(stderr, "usage: pack_table [--svg FILE]\n");
    return 2;
  }
  published_table();
  mixes_table();
  return 0;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  return kiln::run(argc, argv);
}
