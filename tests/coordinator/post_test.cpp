#include "coordinator/bake/post/stage.h"

namespace kiln {
namespace {

// A map of one page from rows of characters: digits are measured texels with that value of chart 1, letters
// a..z of chart 2 (a = 1), '#' belongs to chart 1 without a measurement, '!' saw the inside, '.' is empty.
struct Drawn {
  Lightmap map;
  Atlas atlas;
};

Drawn draw(const std::vector<std::string>& rows, uint32_t pages = 1) {
  Drawn d;
  d.atlas.width = d.map.planes.width = static_cast<uint32_t>(rows[0].size());
  d.map.planes.height = static_cast<uint32_t>(rows.size());
  d.atlas.height = d.map.page_height = static_cast<uint32_t>(rows.size()) / pages;
  d.atlas.pages = pages;
  d.map.planes.add("E.R");
  d.map.planes.add("samples");
  for (const std::string& row : rows)
    for (char c : row) {
      const size_t t = d.map.validity.size();
      const bool digit = c >= '0' && c <= '9', letter = c >= 'a' && c <= 'z';
      d.map.validity.push_back(digit || letter ? Validity::kMeasured
                               : c == '!'      ? Validity::kInside
                                               : Validity::kEmpty);
      d.map.planes.data[0][t] = digit      ? static_cast<float>(c - '0')
                                : letter   ? static_cast<float>(c - 'a' + 1)
                                : c == '!' ? 99.0f
                                           : 0.0f;
      d.map.planes.data[1][t] = digit || letter ? 64.0f : 0.0f;
      d.atlas.owner.push_back(c == '.' ? 0 : letter ? 2 : 1);
    }
  return d;
}

float at(const Drawn& d, int x, int y) {
  return d.map.planes.data[0][static_cast<size_t>(y) * d.map.planes.width + x];
}
Validity kind(const Drawn& d, int x, int y) {
  return d.map.validity[static_cast<size_t>(y) * d.map.planes.width + x];
}

TEST(Fill, TakesTheMeanOfItsOwnChartOnly) {
  Drawn d = draw({"24z", "##z", "..z"});
  fill_invalid(d.map, {{}, d.atlas, {}});
  EXPECT_FLOAT_EQ(at(d, 0, 1), 3);
  EXPECT_FLOAT_EQ(at(d, 1, 1), 3);  // z's are another chart
  EXPECT_EQ(kind(d, 1, 1), Validity::kFilled);
  EXPECT_EQ(kind(d, 0, 2), Validity::kEmpty);
}

TEST(Fill, ReplacesWhatSawTheInsideAndGoesRingByRing) {
  Drawn d = draw({"5!!!"});
  fill_invalid(d.map, {{}, d.atlas, {}});
  for (int x = 0; x < 4; ++x) EXPECT_FLOAT_EQ(at(d, x, 0), 5);
}

TEST(Fill, AChartWithNothingToFillFromStaysInsideAndBlack) {
  Drawn d = draw({"!!.", "...", "..c"});
  fill_invalid(d.map, {{}, d.atlas, {}});
  EXPECT_EQ(kind(d, 0, 0), Validity::kInside);
  EXPECT_FLOAT_EQ(at(d, 0, 0), 0);
}

TEST(Fill, DoesNotCrossPages) {
  Drawn d = draw({"7", "#"}, 2);
  fill_invalid(d.map, {{}, d.atlas, {}});
  EXPECT_EQ(kind(d, 0, 1), Validity::kEmpty);
}

TEST(Dilate, ReachesAsFarAsAskedAndNoFurther) {
  BakeSettings settings;
  settings.dilate = 2;
  Drawn d = draw({"6....", "....."});
  dilate(d.map, {{}, d.atlas, settings});
  EXPECT_FLOAT_EQ(at(d, 2, 1), 6);
  EXPECT_EQ(kind(d, 2, 0), Validity::kDilated);
  EXPECT_EQ(kind(d, 3, 0), Validity::kEmpty);
  EXPECT_FLOAT_EQ(d.map.planes.data[1][1], 0);  // samples are counts: never spread
}

TEST(Dilate, MeasuredTexelsAreNeverTouched) {
  BakeSettings settings;
  Drawn d = draw({"3.b"});
  dilate(d.map, {{}, d.atlas, settings});
  EXPECT_FLOAT_EQ(at(d, 0, 0), 3);
  EXPECT_FLOAT_EQ(at(d, 1, 0), 2.5f);
  EXPECT_FLOAT_EQ(at(d, 2, 0), 2);
}

TEST(Dilate, TexelsOfAChartNeverTakeAnotherChartsValue) {
  BakeSettings settings;
  settings.dilate = 4;
  Drawn d = draw({"##.", "..c", "..."});  // chart 1 has no measured texel, and nothing goes on from it
  const Figures figures = fill_invalid(d.map, {{}, d.atlas, settings});
  dilate(d.map, {{}, d.atlas, settings});
  for (int x = 0; x < 2; ++x) {
    EXPECT_EQ(at(d, x, 0), 0) << x;
    EXPECT_EQ(kind(d, x, 0), Validity::kEmpty) << x;
  }
  EXPECT_FLOAT_EQ(at(d, 2, 0), 3);  // the gutter takes it
  ASSERT_EQ(figures.size(), 2u);
  EXPECT_EQ(figures[0].value, 2);
  EXPECT_EQ(figures[1].value, 2);
}

// Every texel of a chart holds the chart's own value through all stages: charts of as many colours side by
// side, with holes, some of them without any measured texel.
TEST(PostStages, NoOwnedTexelTakesAValueOfAnotherChart) {
  std::vector<std::string> rows;
  for (int y = 0; y < 24; ++y) {
    std::string row;
    for (int x = 0; x < 48; ++x) row += x % 6 == 5 || y % 6 == 5 ? '.' : '5';
    rows.push_back(row);
  }
  Drawn d = draw(rows);
  d.map.planes.data.insert(d.map.planes.data.begin() + 1, 2, d.map.planes.data[0]);  // E.R E.G E.B samples
  d.map.planes.names = {"E.R", "E.G", "E.B", "samples"};
  d.map.planes.add("error");
  uint64_t state = 7;
  for (size_t t = 0; t < d.atlas.owner.size(); ++t) {
    if (d.atlas.owner[t] == 0) continue;
    const size_t chart = t / 48 / 6 * 8 + t % 48 / 6;
    d.atlas.owner[t] = static_cast<uint32_t>(chart + 1);
    state = state * 6364136223846793005u + 1442695040888963407u;
    d.map.validity[t] = chart % 5 == 4     ? (chart % 2 ? Validity::kEmpty : Validity::kInside)
                        : state >> 62 == 0 ? Validity::kEmpty
                        : state >> 61 == 2 ? Validity::kPushed
                                           : Validity::kMeasured;
    for (size_t p = 0; p < 3; ++p) d.map.planes.data[p][t] = static_cast<float>(chart + 1);
  }
  d.atlas.placements.resize(32);
  BakeSettings settings;
  settings.dilate = 3;
  for (const PostStage& stage : post_stages()) stage.run(d.map, {{}, d.atlas, settings});
  size_t black = 0, gutter = 0;
  for (size_t t = 0; t < d.atlas.owner.size(); ++t) {
    gutter += d.atlas.owner[t] == 0 && d.map.validity[t] == Validity::kDilated;
    if (d.atlas.owner[t] == 0) continue;
    const bool none = (d.atlas.owner[t] - 1) % 5 == 4;
    black += none;
    EXPECT_EQ(d.map.planes.data[0][t], none ? 0.0f : static_cast<float>(d.atlas.owner[t])) << t;
    EXPECT_EQ(is_set(d.map.validity[t]), !none) << t;
  }
  EXPECT_GT(black, 100u);
  EXPECT_GT(gutter, 100u);
}

}  // namespace
}  // namespace kiln
