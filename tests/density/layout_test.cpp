// Factors in the atlas, and the table and the advice of the plan. A square of S steps has (S + 1)^2 texels
// with surface points: its corners lie on texel centres.
#include <cmath>

#include "coordinator/bake/plan/advice.h"
#include "coordinator/scene/density/density.h"
#include "tests/density/squares.h"

namespace kiln {
namespace {
using test::GltfBuilder;
using test::imported;
using test::kiln_extras;
using test::square_at;
using test::square_meshes;

struct Planned {
  ImportResult imported;
  AtlasSettings settings;
  Atlas atlas;
  std::vector<ObjectPlan> objects;
};

Planned plan(const GltfBuilder& builder, AtlasSettings settings) {
  Planned p;
  p.imported = imported(builder);
  p.settings = std::move(settings);
  p.settings.density = density_factors(p.imported.scene, p.imported.density, {}).by_instance;
  auto atlas = build_atlas(p.imported.scene, p.settings);
  EXPECT_TRUE(atlas) << (atlas ? "" : atlas.error().message);
  if (atlas) p.atlas = std::move(*atlas);
  p.objects = plan_objects(p.imported.scene, p.atlas, p.settings.density);
  return p;
}

// Squares of 16 m side by side with these densities.
GltfBuilder squares(const std::vector<double>& densities) {
  GltfBuilder b = square_meshes(16);
  for (size_t i = 0; i < densities.size(); ++i) {
    test::json node = square_at("s" + std::to_string(i), 20.0 * static_cast<double>(i));
    if (densities[i] != 1) node["extras"] = kiln_extras({{"density", densities[i]}});
    b.node(node);
  }
  return b;
}

AtlasSettings packed(float texels_per_metre) {
  AtlasSettings s;
  s.layout = AtlasSettings::Layout::kPack;
  s.texels_per_metre = texels_per_metre;
  return s;
}

TEST(DensityLayout, TexelsFollowTheSquareOfTheFactor) {
  const Planned p = plan(squares({1, 2, 0.5, 0.25}), packed(4));
  ASSERT_EQ(p.objects.size(), 4u);
  for (size_t i = 0; i < 4; ++i) {
    const double factor = std::vector<double>{1, 2, 0.5, 0.25}[i];
    const auto steps = static_cast<uint64_t>(64 * factor);
    EXPECT_EQ(p.objects[i].valid_texels, (steps + 1) * (steps + 1)) << i;
    EXPECT_NEAR(p.objects[i].texels_per_metre, 4 * factor, 1e-5 * 4 * factor) << i;  // float placement
    EXPECT_EQ(p.objects[i].factor, factor);
    EXPECT_NEAR(p.objects[i].square_metres, 256, 1e-9);
  }
}

TEST(DensityLayout, ABudgetKeepsTheRatios) {
  AtlasSettings settings = packed(8);
  settings.texel_budget = 20000;
  const Planned p = plan(squares({1, 2, 0.5}), settings);
  const double density = p.atlas.statistics.texels_per_metre;
  EXPECT_LE(p.atlas.texel_count(), 20000u);
  EXPECT_LT(density, 8);
  for (size_t i = 0; i < 3; ++i) {
    // Charts are rounded up to whole steps: by less than one of them.
    const double wished = density * p.objects[i].factor;
    EXPECT_GE(p.objects[i].texels_per_metre, wished * (1 - 1e-3)) << i;
    EXPECT_LE(p.objects[i].texels_per_metre, wished + 1.0 / 16 + 1e-3) << i;
  }
}

TEST(PlanObjects, SumToTheTotals) {
  for (const bool pack : {true, false}) {
    AtlasSettings settings = packed(3);
    GltfBuilder b = pack ? squares({1, 2, 0.7}) : squares({1});
    if (!pack) {
      settings.layout = AtlasSettings::Layout::kAtlas;
      settings.width = settings.height = 50;
    }
    const Planned p = plan(b, settings);
    uint64_t texels = 0, valid = 0, charts = 0;
    for (const ObjectPlan& o : p.objects) texels += o.texels, valid += o.valid_texels, charts += o.charts;
    EXPECT_GT(valid, 0u);
    EXPECT_EQ(texels, p.atlas.statistics.mask_texels);
    EXPECT_EQ(valid, p.atlas.sites.size());
    EXPECT_EQ(charts, p.atlas.placements.size());
    if (!pack) EXPECT_NEAR(p.objects[0].texels_per_metre, 50.0 / 16, 1e-5);
  }
}

TEST(DensityLayout, AChartLargerThanAPageNamesTheDensityThatFits) {
  AtlasSettings settings = packed(4);
  settings.max_page_size = 32;
  const Planned p = plan(squares({1}), settings);
  ASSERT_FALSE(p.atlas.warnings.empty());
  const std::string& warning = p.atlas.warnings.back();
  EXPECT_SAYS(warning, "'s0'; at --texels-per-metre ");
  settings.texels_per_metre = std::stof(warning.substr(warning.find("metre ", warning.find("--")) + 6));
  EXPECT_GT(settings.texels_per_metre, 1.8f);  // 31 steps on 16 m are 1.93
  EXPECT_TRUE(plan(squares({1}), settings).atlas.warnings.empty());
}

TEST(Advice, SaysWhatManyTexelsCostAndWhatWouldDo) {
  Planned p = plan(squares({1, 0.5}), packed(4));
  EXPECT_EQ(advise_density(p.imported.scene, p.atlas, p.settings, p.objects, 100), "");
  // As if the scene were laid out far denser: only the counts matter.
  const double scale = 17e6 / static_cast<double>(p.atlas.sites.size());
  p.atlas.sites.texel.resize(17000000);
  for (ObjectPlan& o : p.objects)
    o.valid_texels = static_cast<uint64_t>(scale * static_cast<double>(o.valid_texels));
  const std::string advice = advise_density(p.imported.scene, p.atlas, p.settings, p.objects, 3540);
  EXPECT_SAYS(
      advice,
      "the scene is 36 m wide: at 4 texels per metre it takes 17 million texels, at least 59 minutes");
  EXPECT_SAYS(advice, "--texels-per-metre 1 would take ");  // 4 sqrt(2/17) = 1.37
  EXPECT_SAYS(advice, "Most texels are on 's0' 80 %, 's1' 20 %");
  p.settings.texel_budget = 1;  // somebody has decided
  EXPECT_EQ(advise_density(p.imported.scene, p.atlas, p.settings, p.objects, 3540), "");
}

// Two squares of 16 m at factors 4 and 1 of 4 texels a metre: 257^2 and 65^2 texels.
TEST(Advice, NamesAnObjectWithMostOfTheTexels) {
  const Planned p = plan(squares({4, 1}), packed(4));
  const auto advice = advise_layout(p.imported.scene, p.atlas, p.settings, p.objects);
  ASSERT_EQ(advice.size(), 1u);
  EXPECT_SAYS(advice[0], "'s0' takes 94 % of the texels");
  // sqrt(65^2 / 257^2) = 0.253 of its factor 4.
  EXPECT_SAYS(advice[0], "extras.kiln.density 1 on it");
  const Planned even = plan(squares({1, 1, 1}), packed(4));
  EXPECT_TRUE(advise_layout(even.imported.scene, even.atlas, even.settings, even.objects).empty());
  const Planned alone = plan(squares({4}), packed(4));
  EXPECT_TRUE(advise_layout(alone.imported.scene, alone.atlas, alone.settings, alone.objects).empty());
}

TEST(Advice, NamesTheDensityThatACoarseMapWants) {
  const Planned p = plan(squares({1, 1}), packed(0.2f));
  const auto advice = advise_layout(p.imported.scene, p.atlas, p.settings, p.objects);
  ASSERT_EQ(advice.size(), 1u);
  EXPECT_SAYS(advice[0], "the map is coarse: 50 texels for 2 objects at 0.2 texels per metre");
  const size_t at = advice[0].find("--texels-per-metre ");
  ASSERT_NE(at, std::string::npos) << advice[0];
  const Planned fine = plan(squares({1, 1}), packed(std::stof(advice[0].substr(at + 19))));
  EXPECT_TRUE(advise_layout(fine.imported.scene, fine.atlas, fine.settings, fine.objects).empty());
  EXPECT_GE(fine.objects[0].valid_texels, 1024u);
}

TEST(Advice, RefusesWhatMemoryDoesNotHoldAndNamesWhatItDoes) {
  const Planned p = plan(squares({4, 1}), packed(4));
  const BakeSettings settings;
  Plan dense = make_plan(p.imported.scene, p.atlas, settings, 1);
  dense.objects = p.objects;
  const uint64_t needed = dense.coordinator_bytes + dense.worker_bytes;
  EXPECT_TRUE(check_memory(dense, p.atlas, needed));
  const uint64_t memory = needed - dense.texel_bytes / 2;
  const Status refused = check_memory(dense, p.atlas, memory);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::kInvalidInput);
  const std::string& message = refused.error().message;
  EXPECT_SAYS(message, "most texels are on 's0' 94 %");
  const size_t at = message.find("--texels-per-metre ");
  ASSERT_NE(at, std::string::npos) << message;
  const Planned fits = plan(squares({4, 1}), packed(std::stof(message.substr(at + 19))));
  EXPECT_TRUE(check_memory(make_plan(fits.imported.scene, fits.atlas, settings, 1), fits.atlas, memory));
  EXPECT_FALSE(check_memory(dense, p.atlas, 1000)) << "not even the scene";
}

// A budget gives the same layout whatever density it starts from, if that is not the limit.
TEST(DensityLayout, ABudgetDoesNotDependOnWhereItStarts) {
  std::vector<double> density;
  for (const float start : {16.0f, 64.0f, 512.0f}) {
    AtlasSettings settings = packed(start);
    settings.texel_budget = 20000;
    settings.cut_contacts = true;
    const Planned p = plan(squares({1, 2, 0.5}), settings);
    EXPECT_LE(p.atlas.texel_count(), 20000u);
    density.push_back(p.atlas.statistics.texels_per_metre);
  }
  EXPECT_NEAR(density[1], density[0], 0.02 * density[0]);
  EXPECT_NEAR(density[2], density[0], 0.02 * density[0]);
}

}  // namespace
}  // namespace kiln
