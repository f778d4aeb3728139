#include "common/job/settings.h"

#include "common/job/unit.h"

namespace kiln {
namespace {

// What a row prints it also reads: report.json can be fed back as a job file.
TEST(Settings, EveryRowReadsWhatItPrints) {
  const BakeSettings defaults;
  for (const Setting& row : settings_table()) {
    const std::string value = row.print(defaults);
    BakeSettings again;
    if (value.empty()) continue;  // not set: nothing to read
    EXPECT_TRUE(row.parse(again, value)) << row.name << " " << value;
    EXPECT_EQ(row.print(again), value) << row.name;
  }
}

TEST(Settings, SeveralSunsReadAsTheyPrint) {
  BakeSettings two, again;
  ASSERT_TRUE(set_option(two, "sun", "0,1,0:1,2,3", "test"));
  ASSERT_TRUE(set_option(two, "sun", "1,0.5,0:4,5,6", "test"));
  const auto row = std::find_if(settings_table().begin(), settings_table().end(),
                                [](const Setting& r) { return std::string(r.name) == "sun"; });
  ASSERT_TRUE(row->parse(again, row->print(two)));
  ASSERT_EQ(again.suns.size(), 2u);
  EXPECT_EQ(row->print(again), row->print(two));
  EXPECT_FALSE(set_option(again, "sun", "0,1,0:1,2,3 ", "test"));
}

TEST(Settings, ErrorsNameTheOptionAndTheValue) {
  BakeSettings s;
  for (const auto& [name, value] : std::vector<std::pair<std::string, std::string>>{{"error", "abc"},
                                                                                    {"error", "-1"},
                                                                                    {"error", "nan"},
                                                                                    {"max-bounces", "1.5"},
                                                                                    {"layout", "round"},
                                                                                    {"unwrap", "never"},
                                                                                    {"resolution", "12x"},
                                                                                    {"sun", "1,2,3"},
                                                                                    {"sun", "0,0,0:1,1,1"},
                                                                                    {"components", "both"},
                                                                                    {"materials", "lambert"},
                                                                                    {"split", "direct"},
                                                                                    {"basis", "sg"},
                                                                                    {"isa", "neon"},
                                                                                    {"sampler", "sobol"},
                                                                                    {"watertight", "yes"},
                                                                                    {"seed", "-3"},
                                                                                    {"workers", "1e9"}}) {
    const Status status = set_option(s, name, value, "test");
    ASSERT_FALSE(status) << name << " " << value;
    EXPECT_NE(status.error().message.find(name), std::string::npos);
    EXPECT_EQ(exit_status(status.error()), 2);
  }
  EXPECT_FALSE(set_option(s, "colour", "1", "test"));
}

// As people write them; a bare number above 1 may be either and is asked about.
TEST(Settings, SharesAndTimes) {
  BakeSettings s;
  const auto read = [&](const char* name, const char* value, double& number) {
    const Status status = set_option(s, name, value, "test");
    EXPECT_TRUE(status) << name << " " << value << (status ? "" : status.error().message);
    return number;
  };
  EXPECT_DOUBLE_EQ(read("error", "5%", s.error), 0.05);
  EXPECT_DOUBLE_EQ(read("error", "0.02", s.error), 0.02);
  EXPECT_DOUBLE_EQ(read("error", "1", s.error), 1);
  EXPECT_DOUBLE_EQ(read("error", "250%", s.error), 2.5);
  EXPECT_DOUBLE_EQ(read("confidence", "99%", s.confidence), 0.99);
  EXPECT_DOUBLE_EQ(read("max-encode-error", "1.5%", s.max_encode_error), 0.015);
  EXPECT_DOUBLE_EQ(read("time-limit", "90", s.time_limit), 90);
  EXPECT_DOUBLE_EQ(read("time-limit", "20s", s.time_limit), 20);
  EXPECT_DOUBLE_EQ(read("time-limit", "1.5m", s.time_limit), 90);
  EXPECT_DOUBLE_EQ(read("time-limit", "1h30m", s.time_limit), 5400);
  for (const auto& [name, value] : std::vector<std::pair<const char*, const char*>>{{"error", "5"},
                                                                                    {"error", "%"},
                                                                                    {"error", "5 %"},
                                                                                    {"error", "2000%"},
                                                                                    {"error", "0%"},
                                                                                    {"confidence", "95"},
                                                                                    {"confidence", "100%"},
                                                                                    {"time-limit", "2x"},
                                                                                    {"time-limit", "-1s"},
                                                                                    {"time-limit", "s"},
                                                                                    {"time-limit", "30m1h"},
                                                                                    {"time-limit", "1h30"},
                                                                                    {"time-limit", "1m1m"},
                                                                                    {"time-limit", "1e12"}})
    EXPECT_FALSE(set_option(s, name, value, "test")) << name << " " << value;
  const Status asked = set_option(s, "error", "5", "test");
  EXPECT_NE(asked.error().message.find("5%"), std::string::npos) << asked.error().message;
  EXPECT_NE(asked.error().message.find("500%"), std::string::npos) << asked.error().message;
  // Above 1 a row prints what it reads again.
  for (const Setting& row : settings_table()) {
    if (std::string(row.name) != "error") continue;
    BakeSettings again;
    ASSERT_TRUE(row.parse(s, "250%"));
    EXPECT_TRUE(row.parse(again, row.print(s))) << row.print(s);
    EXPECT_EQ(again.error, s.error);
  }
}

const Setting& row_of(const std::string& name) {
  return *std::find_if(settings_table().begin(), settings_table().end(),
                       [&](const Setting& r) { return r.name == name; });
}

TEST(Settings, EveryWordGoesToTheFieldOfItsRow) {
  struct Row {
    const char* name;
    std::string BakeSettings::*field;
    std::vector<const char*> words;
  };
  const std::vector<Row> rows = {{"lamps", &BakeSettings::lamps, {"drop", "keep", "mark"}},
                                 {"materials", &BakeSettings::materials, {"full", "diffuse"}},
                                 {"sh-fit", &BakeSettings::sh_fit, {"cap", "positive", "project"}},
                                 {"sh-evaluator", &BakeSettings::sh_evaluator, {"linear", "hazel"}}};
  const BakeSettings defaults;
  for (const Row& row : rows) {
    EXPECT_EQ(defaults.*row.field, row.words[0]);
    for (const char* word : row.words) {
      BakeSettings s;
      ASSERT_TRUE(set_option(s, row.name, word, "test")) << row.name << " " << word;
      EXPECT_EQ(row_of(row.name).print(s), word);
      for (const Row& other : rows)
        EXPECT_EQ(s.*other.field, other.field == row.field ? word : defaults.*other.field) << row.name;
    }
    for (const char* word : {"", "Drop", "half", "auto"}) {
      BakeSettings s;
      const Status status = set_option(s, row.name, word, "test");
      ASSERT_FALSE(status) << row.name << " " << word;
      EXPECT_NE(status.error().message.find(row.name), std::string::npos);
      EXPECT_EQ(s.*row.field, defaults.*row.field);
    }
  }
}

TEST(Settings, ListsSwitchWhatTheyNameOnAndTheRestOff) {
  for (const auto& [name, words] : std::vector<std::pair<const char*, std::vector<const char*>>>{
           {"probe-files", {"bevy", "bevy,textures", "textures", "none"}},
           {"gltf-lightmap", {"kiln,moz,epic,mx", "kiln,moz,epic", "moz", "kiln,epic", "none", "kiln"}}}) {
    BakeSettings s;
    for (const char* list : words) {
      ASSERT_TRUE(set_option(s, name, list, "test")) << name << " " << list;
      EXPECT_EQ(row_of(name).print(s), list);
    }
    for (const char* list : {"", "none,", "moz,bevy", "all"}) {
      const Status status = set_option(s, name, list, "test");
      ASSERT_FALSE(status) << name << " " << list;
      EXPECT_NE(status.error().message.find("or none alone"), std::string::npos) << status.error().message;
      EXPECT_EQ(row_of(name).print(s), words.back());
    }
  }
}

TEST(Settings, TheBoundOfTextureErrorsIsANumberOrAutomatic) {
  BakeSettings s;
  EXPECT_EQ(s.max_encode_error, kAutoBound);
  for (const auto& [value, bound] :
       {std::pair("0", 0.0), {"auto", kAutoBound}, {"0.02", 0.02}, {"auto", kAutoBound}}) {
    ASSERT_TRUE(set_option(s, "max-encode-error", value, "test")) << value;
    EXPECT_EQ(s.max_encode_error, bound);
    EXPECT_EQ(row_of("max-encode-error").print(s), value);
  }
  for (const char* value : {"-1", "11", "automatic", "Auto", ""})
    EXPECT_FALSE(set_option(s, "max-encode-error", value, "test")) << value;
  EXPECT_EQ(s.max_encode_error, kAutoBound);
}

TEST(Settings, WhoSetItIsKept) {
  BakeSettings s;
  ASSERT_TRUE(set_option(s, "error", "0.1", "job file a.json"));
  ASSERT_TRUE(set_option(s, "error", "0.2", "command line"));
  EXPECT_EQ(s.source.at("error"), "command line");
  EXPECT_EQ(s.source.count("seed"), 0u);
}

TEST(Settings, ASplitNeedsBothParts) {
  BakeSettings s;
  ASSERT_TRUE(set_option(s, "split", "direct,indirect", "test"));
  EXPECT_TRUE(check_settings(s));
  for (const auto& [name, value] :
       {std::pair("components", "direct"), {"components", "indirect"}, {"quantities", "ao"}}) {
    BakeSettings without = s;
    ASSERT_TRUE(set_option(without, name, value, "test"));
    const Status status = check_settings(without);
    ASSERT_FALSE(status) << value;
    EXPECT_NE(status.error().message.find(std::string("--") + name + " " + value), std::string::npos);
  }
}

TEST(Job, SaysWhichSumsOfLightItNeeds) {
  JobSpec job;
  const Bytes plain = write_job(job);
  for (const auto& [direct, all] : {std::pair(true, false), {false, true}, {true, true}}) {
    job.transport.quantities.direct_apart = direct;
    job.transport.quantities.all_light = all;
    const Bytes bytes = write_job(job);
    EXPECT_NE(bytes, plain);
    const auto back = read_job(bytes);
    ASSERT_TRUE(back);
    EXPECT_EQ(back->transport.quantities, job.transport.quantities);
    const MomentLayout layout(0, back->transport.quantities);
    EXPECT_EQ(layout.planes(), MomentLayout(0).planes() + 3 * (direct + all));
    EXPECT_EQ(layout.names().size(), layout.planes());
    job.transport.quantities.cache_draws = true;
    EXPECT_EQ(read_job(write_job(job))->transport.quantities, job.transport.quantities);
    EXPECT_EQ(MomentLayout(0, job.transport.quantities).planes(), layout.planes() + kCacheDraws);
    EXPECT_EQ(MomentLayout(0, job.transport.quantities).names().size(), layout.planes() + kCacheDraws);
    job.transport.quantities.cache_draws = false;
    JobSpec dark = job;  // parts of no light
    dark.transport.quantities.light = false;
    EXPECT_FALSE(read_job(write_job(dark)));
  }
}

TEST(Job, RoundTripsAndRefusesASamplerThatDoesNotExist) {
  JobSpec job;
  job.id = 7;
  job.transport = {.basis = 0,
                   .direct = false,
                   .max_bounces = 3,
                   .seed = 11,
                   .sampler = Sampler::kPmj02,
                   .watertight = true};
  Bytes bytes = write_job(job);
  const auto back = read_job(bytes);
  ASSERT_TRUE(back);
  EXPECT_EQ(write_job(*back), bytes);
  EXPECT_EQ(back->transport.sampler, Sampler::kPmj02);
  EXPECT_TRUE(back->transport.watertight);
  job.transport.sampler = Sampler::kOwen;
  EXPECT_NE(write_job(job), bytes);  // it decides bytes of the result, so it is part of the job's
  job.transport.sampler = static_cast<Sampler>(kSamplers);
  const auto refused = read_job(write_job(job));
  ASSERT_FALSE(refused);
  EXPECT_NE(refused.error().message.find("sampler 4"), std::string::npos);
  bytes.pop_back();
  EXPECT_FALSE(read_job(bytes));
}

TEST(Settings, MostSamplesFollowFromTheNormUnlessTheyAreGiven) {
  BakeSettings s;
  EXPECT_EQ(s.most_samples(), s.max_samples);
  EXPECT_EQ(s.most_of_each(), 16384u);
  for (const char* norm : {"max", "perceptual"}) {
    s.error_norm = norm;
    EXPECT_EQ(s.most_samples(), 16384u);
  }
  const auto printed = [&] {
    for (const Setting& row : settings_table())
      if (std::string_view(row.name) == "max-samples") return row.print(s);
    return std::string();
  };
  EXPECT_EQ(printed(), "16384") << "reports show what holds";
  s.min_samples = 20000;
  EXPECT_EQ(s.most_samples(), 20000u);
  ASSERT_TRUE(set_option(s, "max-samples", "50000", "test"));
  EXPECT_EQ(s.most_samples(), 50000u);
  EXPECT_EQ(s.most_of_each(), 50000u);
}

TEST(Settings, LargeMapsHaveFewerSamplesAtLeastUnlessTheyAreGiven) {
  EXPECT_EQ(BakeSettings().least_samples(131'071, true), 64u);
  EXPECT_EQ(BakeSettings().least_samples(131'072, true), 16u);

  constexpr uint64_t kLarge = 1u << 20;
  BakeSettings alone;
  alone.denoise = false;
  EXPECT_EQ(alone.least_samples(kLarge, true), 64u) << "nothing looks at neighbours together";
  EXPECT_EQ(BakeSettings().least_samples(kLarge, false), 64u) << "whole paths";
  for (const char* norm : {"max", "perceptual"}) {
    BakeSettings each;
    each.error_norm = norm;
    EXPECT_EQ(each.least_samples(kLarge, true), 64u) << "every texel has a bound to keep";
  }
  BakeSettings without_light;
  without_light.quantities.light = false;
  EXPECT_EQ(without_light.least_samples(kLarge, true), 64u);
  BakeSettings fixed;
  ASSERT_TRUE(set_option(fixed, "max-samples", "64", "test"));
  EXPECT_EQ(fixed.least_samples(kLarge, true), 64u) << "a fixed count";
  BakeSettings given;
  ASSERT_TRUE(set_option(given, "min-samples", "64", "test"));
  EXPECT_EQ(given.least_samples(kLarge, true), 64u);
  BakeSettings few;
  few.min_samples = 8;
  EXPECT_EQ(few.least_samples(kLarge, true), 8u) << "never more than asked for";
}

TEST(Settings, RulesBetweenOptions) {
  BakeSettings s;
  s.min_samples = 100;
  s.max_samples = 50;
  EXPECT_FALSE(check_settings(s));
}

}  // namespace
}  // namespace kiln
