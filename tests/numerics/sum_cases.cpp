#include "common/responses/quantities.h"
#include "tests/numerics/cases.h"
#include "worker/bake/film.h"

namespace kiln::test {
namespace {

constexpr uint32_t kSamples = 1'000'000, kRange = 1024;

// E of a texel, summed as bakes do: in ranges, which are then added.
template <class F>
double summed(const F& contribution) {
  const MomentLayout layout(1);
  const ResponseSettings response;
  Film film(layout, response);
  double sum = 0;
  for (uint32_t i = 0; i < kSamples; ++i) {
    RadianceSamples s;
    s.add({0, 1, 0}, Vec3(contribution(i)), Arriving::kDirect);
    EXPECT_TRUE(film.add(s, {0, 1, 0}));
    if ((i + 1) % kRange == 0 || i + 1 == kSamples) {
      sum += film.sums()[kMomentEG];
      film.clear();
    }
  }
  return sum;
}
// Exact: contributions are multiples of 2^-44 below 2^40, so a sum of 2^20 is within 128 bits.
template <class F>
long double exact(const F& contribution) {
  __int128 sum = 0;
  for (uint32_t i = 0; i < kSamples; ++i)
    sum += static_cast<__int128>(std::ldexp(static_cast<long double>(contribution(i)), 44));
  return std::ldexp(static_cast<long double>(sum), -44);
}

// From 2^-20 to 2^20, over twelve orders of magnitude.
float random_number(uint32_t i) {
  return std::ldexp(1 + unit_float(hash_bits(i)), static_cast<int>(i % 40) - 20);
}
float near_one(uint32_t i) {
  return 0.5f + unit_float(hash_bits(i));
}

// An addition errs by 2^-53 of its result at most: 1,023 of a range, and one for each range.
Measured million() {
  const long double truth = exact(random_number);
  const double relative = static_cast<double>((summed(random_number) - truth) / truth);
  return {0, relative, (kRange + kSamples / kRange + 1) * 0x1p-53};
}

Measured ratio_of_a_billion() {
  const auto few = [](uint32_t i) { return i % 1000 == 500 ? 1e9f : 0.0f; };
  const auto all = [&](uint32_t i) { return few(i) > 0 ? few(i) : near_one(i); };
  const long double large = exact(few), small = exact(all) - large;
  const double relative = static_cast<double>((summed(all) - large - small) / small);
  const double bound = (kRange + kSamples / kRange + 1) * 0x1p-53;
  return {0, relative, bound * static_cast<double>((large + small) / small)};
}

// A lamp, and a panel as bright as floats go 2 cm over the floor: what it sends straight down is beyond them.
class Overflowing {
 public:
  Overflowing() {
    SceneMaker m;
    const uint32_t floor = m.lambert(Vec3(0.5f)), lamp = m.lambert(Vec3(0.0f), Vec3(5.0f));
    const uint32_t hot = m.lambert(Vec3(0.0f), Vec3(3e38f));
    m.quad({0, 0, 0}, {0, 0, 2}, {2, 0, 0}, floor);
    m.quad({0.5f, 1, 0.5f}, {0.5f, 0, 0}, {0, 0, 0.5f}, lamp);
    m.quad({1, 0.02f, 1}, {0.1f, 0, 0}, {0, 0, 0.1f}, hot);
    AtlasSettings a;
    a.layout = AtlasSettings::Layout::kPack;
    a.texels_per_metre = 4;
    Scene scene = m.take();
    Atlas atlas = build_atlas(scene, a).value();
    texels = atlas.sites.texel;
    baker_ = Baker::create(std::move(scene), std::move(atlas), {}, 1).value();
    for (uint32_t site = 0; site < texels.size(); ++site) all.push_back(site);
    whole = sample(all, 0, kCount);
    EXPECT_GT(whole.nonfinite, 0u);
    EXPECT_LT(whole.nonfinite, texels.size() * kCount / 10);
  }
  UnitResult sample(std::vector<uint32_t> sites, uint32_t first, uint32_t count) const {
    return baker_->bake({0, first, count, std::move(sites)}).value();
  }
  static constexpr uint32_t kCount = 128;
  std::vector<uint32_t> texels, all;
  UnitResult whole;

 private:
  std::unique_ptr<Baker> baker_;
};

// Every site and sample alone: those that drop something, and sums made of them.
Measured replayed() {
  const Overflowing scene;
  uint64_t alone = 0, wrong = 0;
  for (uint32_t site : scene.all)
    for (uint32_t i = 0; i < Overflowing::kCount; ++i) {
      const UnitResult r = scene.sample({site}, i, 1);
      if (r.nonfinite && alone == 0)  // the first is the one that the whole unit names
        wrong += scene.whole.nonfinite_texel != scene.texels[site] || scene.whole.nonfinite_sample != i;
      if (r.nonfinite) wrong += r.nonfinite_texel != scene.texels[site] || r.nonfinite_sample != i;
      alone += r.nonfinite;
    }
  return {static_cast<double>(scene.whole.nonfinite), static_cast<double>(alone + 1'000'000 * wrong), 0};
}

// The sums of a sample baked alone are rounded once less or more than among others: 2^-53 of the absolute
// sum for each of at most three contributions.
Measured spread() {
  const Overflowing scene;
  const size_t planes = scene.whole.plane_count;
  double different = 0;
  for (uint32_t site : scene.all) {
    std::vector<double> sums(planes, 0.0), magnitudes(planes, 0.0);
    for (uint32_t i = 0; i < Overflowing::kCount; ++i) {
      const UnitResult r = scene.sample({site}, i, 1);
      for (size_t p = 0; p < planes; ++p) sums[p] += r.moments[p], magnitudes[p] += std::abs(r.moments[p]);
    }
    const double* whole = &scene.whole.moments[site * planes];
    bool same = true;
    for (size_t p = 0; p < planes; ++p)
      same = same && std::abs(sums[p] - whole[p]) <= 2 * 3 * Overflowing::kCount * 0x1p-53 * magnitudes[p];
    const UnitResult r = scene.sample({site}, 0, Overflowing::kCount);
    different += !same || !std::equal(r.moments.begin(), r.moments.end(), whole);
  }
  return {0, different, 0};
}

// Each of the two is a float; together they are not. One of them is dropped, and counted.
Measured overflowing_together() {
  RadianceSamples s;
  s.add({0, 1, 0}, Vec3(3e38f), Arriving::kDirect);
  s.add({0, 1, 0}, Vec3(2e38f), Arriving::kDirect);
  const MomentLayout layout(1);
  const ResponseSettings response;
  Film film(layout, response);
  EXPECT_FALSE(film.add(s, {0, 1, 0}));
  for (const double m : film.sums()) EXPECT_TRUE(std::isfinite(m));
  return {double{3e38f}, film.sums()[kMomentEG], 0};
}

Measured sums_not_finite() {
  const Overflowing scene;
  double count = 0;
  for (const double m : scene.whole.moments) count += !std::isfinite(m);
  return {0, count, 0};
}

}  // namespace

void add_sum_cases(std::vector<Case>& cases) {
  cases.push_back({"a million samples in a texel",
                   "relative error of the sum of values over twelve orders of magnitude against exact "
                   "integers; 2,001 additions of 2^-53 each",
                   million});
  cases.push_back(
      {"contributions of 1e9 among those of 1",
       "error of the sum over the sum of the small ones, of a million; the same bound, of the whole sum",
       ratio_of_a_billion});
  cases.push_back(
      {"contributions beyond float: replay",
       "samples that drop a contribution when baked alone; expected: those of the whole unit, the first "
       "of them where it says",
       replayed});
  cases.push_back(
      {"contributions beyond float: spread",
       "texels whose sums are not, to the bit, those of the texel alone, or, but for rounding, those of its "
       "samples baked one by one",
       spread});
  cases.push_back({"contributions beyond float: what is left", "sums that are not finite", sums_not_finite});
  cases.push_back({"contributions beyond float: together",
                   "E of one sample of 3e38 and 2e38, each of which is a float: one of them is dropped",
                   overflowing_together});
}

}  // namespace kiln::test
