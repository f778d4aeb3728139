// The exposition against the format's own rules, by a strict reader of ours and by promtool where it is
// installed.
#include "coordinator/farm/web/metrics.h"

#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "tests/web/web_support.h"

namespace kiln {
namespace {

struct Exposition {
  std::map<std::string, std::string> types;
  std::map<std::string, double> samples;  // by name and labels as written
  std::string error;
};

Exposition read_exposition(const std::string& text) {
  static const std::regex help(R"(# HELP ([a-zA-Z_:][a-zA-Z0-9_:]*) ([^\n]+))");
  static const std::regex type(R"(# TYPE ([a-zA-Z_:][a-zA-Z0-9_:]*) (gauge|counter))");
  static const std::regex sample(
      R"re(([a-zA-Z_:][a-zA-Z0-9_:]*)(\{[a-zA-Z_]\w*="(?:[^"\\\n]|\\["\\n])*"(?:,[a-zA-Z_]\w*="(?:[^"\\\n]|\\["\\n])*")*\})? (-?[0-9.]+(?:e[+-]?[0-9]+)?))re");
  Exposition e;
  const auto wrong = [&](const std::string& what, const std::string& line) { e.error = what + ": " + line; };
  if (text.empty() || text.back() != '\n') wrong("the last line does not end", "");
  std::string open;  // the metric whose samples follow
  std::set<std::string> helped;
  std::istringstream in(text);
  for (std::string line; std::getline(in, line) && e.error.empty();) {
    std::smatch m;
    if (std::regex_match(line, m, help)) {
      if (!helped.insert(m[1]).second) wrong("a second HELP", line);
    } else if (std::regex_match(line, m, type)) {
      open = m[1];
      if (!helped.count(open)) wrong("no HELP before", line);
      if (!e.types.emplace(open, m[2]).second) wrong("a second TYPE", line);
      if ((m[2] == "counter") != open.ends_with("_total")) wrong("counters end in _total", line);
      if (!open.starts_with("kiln_")) wrong("a name of others", line);
    } else if (std::regex_match(line, m, sample)) {
      if (m[1] != open) wrong("a sample outside of its metric", line);
      if (!e.samples.emplace(m[1].str() + m[2].str(), std::stod(m[3])).second) wrong("a second sample", line);
    } else {
      wrong("not a line of the format", line);
    }
  }
  return e;
}

TEST(Metrics, KeepTheFormat) {
  test::FakeFarm fake;
  fake.farm.jobs[0].user = "a\"d\\a\nb";
  const Exposition e = read_exposition(write_metrics(fake.sources()));
  EXPECT_EQ(e.error, "");
  EXPECT_EQ(e.samples.at("kiln_workers{state=\"baking\"}"), 1);
  EXPECT_EQ(e.samples.at("kiln_workers{state=\"benched\"}"), 0);
  EXPECT_EQ(e.samples.at("kiln_worker_threads"), 28);
  EXPECT_EQ(e.samples.at("kiln_jobs{state=\"queued\"}"), 1);
  EXPECT_EQ(e.samples.at("kiln_jobs{state=\"cancelled\"}"), 0);
  EXPECT_EQ(e.samples.at("kiln_rays_total"), 987654321);
  EXPECT_EQ(e.samples.at("kiln_send_queue_bytes"), 77);
  EXPECT_EQ(e.samples.at("kiln_store_held"), 0);
  EXPECT_EQ(e.samples.at("kiln_store_damaged_blobs_total"), 0);
  EXPECT_EQ(e.samples.at("kiln_job_pass_units_done{job=\"2\",user=\"a\\\"d\\\\a\\nb\"}"), 300);
  EXPECT_EQ(e.types.at("kiln_results_total"), "counter");
}

TEST(Metrics, ReaderNoticesWhatIsWrong) {
  EXPECT_NE(read_exposition("kiln_x 1").error, "");
  EXPECT_NE(read_exposition("# HELP kiln_x a\n# TYPE kiln_x gauge\nkiln_x{a=\"b\"c\"} 1\n").error, "");
  EXPECT_NE(read_exposition("# HELP kiln_x a\n# TYPE kiln_x gauge\nkiln_y 1\n").error, "");
  EXPECT_NE(read_exposition("# HELP kiln_x a\n# TYPE kiln_x gauge\nkiln_x 1\nkiln_x 2\n").error, "");
  EXPECT_EQ(read_exposition("# HELP kiln_x a\n# TYPE kiln_x gauge\nkiln_x 1.5e+06\n").error, "");
}

TEST(Metrics, PromtoolHasNoComplaint) {
  if (test::run_command("command -v promtool").exit_status != 0)
    GTEST_SKIP() << "promtool (Debian: prometheus) is not installed";
  const test::TempDir folder;
  const auto file = folder.path() / "metrics";
  std::ofstream(file) << write_metrics(test::FakeFarm().sources());
  const auto checked = test::run_command("promtool check metrics < " + file.string());
  EXPECT_EQ(checked.exit_status, 0) << checked.output;
  EXPECT_EQ(checked.output, "");
}

TEST(Metrics, AHeldStoreShows) {
  test::FakeFarm fake;
  fake.store.held_for = "no space is left on the disk";
  EXPECT_EQ(read_exposition(write_metrics(fake.sources())).samples.at("kiln_store_held"), 1);
}

}  // namespace
}  // namespace kiln
