#include "coordinator/bake/denoise/spikes.h"

#include "coordinator/bake/neighbours/pieces.h"

namespace kiln {
namespace {

// A strip of sites, linked in a row; light 1 everywhere, in both replicates.
struct Strip {
  TexelStatistics statistics;
  std::vector<uint8_t> known;
  SurfaceLinks links;

  explicit Strip(uint32_t sites) : known(sites, 1) {
    statistics.sites = sites;
    statistics.samples.assign(sites, 16);
    for (std::vector<float>& l : statistics.luminance) l.assign(sites, 1.0f);
    links.first.push_back(0);
    for (uint32_t i = 0; i < sites; ++i) {
      if (i > 0) links.link.push_back(i - 1);
      if (i + 1 < sites) links.link.push_back(i + 1);
      links.first.push_back(static_cast<uint32_t>(links.link.size()));
    }
  }
  Spikes find() const { return find_spikes(statistics, known, surface_pieces(known, links), links, 2); }
  double sum_after(const Spikes& spikes) const {
    double sum = 0;
    for (size_t i = 0; i < statistics.sites; ++i)
      for (uint32_t r = 0; r < kReplicates; ++r)
        sum += double{spikes.gain[i]} * double{spikes.keep[r][i]} * double{statistics.luminance[r][i]};
    return sum;
  }
};

TEST(Spikes, LightOfASpikeGoesToItsSurface) {
  Strip strip(400);
  strip.statistics.luminance[1][200] = 101;
  const Spikes spikes = strip.find();
  EXPECT_LT(spikes.keep[1][200], 0.02f);
  EXPECT_EQ(spikes.keep[0][200], 1.0f);
  EXPECT_NEAR(strip.sum_after(spikes), 900, 0.01);
  EXPECT_NEAR(spikes.gain[0], 1.125, 1e-4);
  EXPECT_NEAR(spikes.relative_error[0], 0.125, 1e-3);
}

TEST(Spikes, LightThatBothReplicatesSeeStays) {
  Strip strip(400);
  for (std::vector<float>& l : strip.statistics.luminance) l[200] = 101;
  const Spikes spikes = strip.find();
  for (uint32_t r = 0; r < kReplicates; ++r) EXPECT_EQ(spikes.keep[r][200], 1.0f);
  EXPECT_EQ(spikes.gain[200], 1.0f);
}

TEST(Spikes, ALineOfLightStays) {
  Strip strip(400);
  for (uint32_t i = 200; i < 203; ++i) strip.statistics.luminance[0][i] = 101;
  const Spikes spikes = strip.find();
  EXPECT_EQ(spikes.keep[0][201], 1.0f);
}

TEST(Spikes, WhereSpikesAreTheLightTheyStay) {
  Strip strip(40);
  strip.statistics.luminance[1][20] = 1001;
  const Spikes spikes = strip.find();
  EXPECT_EQ(spikes.keep[1][20], 1.0f);
  EXPECT_EQ(spikes.gain[20], 1.0f);
}

TEST(Spikes, OtherSurfacesKeepTheirLight) {
  Strip strip(400);
  strip.known[100] = 0;  // the strip falls in two
  strip.statistics.luminance[1][200] = 51;
  const Spikes spikes = strip.find();
  EXPECT_EQ(spikes.gain[50], 1.0f);
  EXPECT_GT(spikes.gain[150], 1.0f);
}

}  // namespace
}  // namespace kiln
