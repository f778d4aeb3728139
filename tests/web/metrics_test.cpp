// The exposition against the format's own rules, by a strict reader of ours and by promtool where it is
// installed.
#include "coordinator/farm/web/metrics.h"

#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <sstream>

#include "common/base/files.h"
#include "common/base/json.h"
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
  const Exposition e = read_exposition(write_metrics(fake.source()));
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
  EXPECT_EQ(e.samples.at("kiln_workers_quarantined"), 1);
  EXPECT_EQ(e.samples.at("kiln_data_bytes{kind=\"inputs\"}"), 1000);
  EXPECT_EQ(e.samples.at("kiln_data_growth_bytes_per_day{kind=\"spool\"}"), -1);
  EXPECT_EQ(e.samples.at("kiln_disk_full_in_seconds"), 20 * 86400);
  EXPECT_EQ(e.samples.at("kiln_retention_next_timestamp_seconds"), 1700000000);
  EXPECT_EQ(e.samples.at("kiln_retention_next_jobs"), 2);
  EXPECT_EQ(e.samples.at("kiln_backup_last_timestamp_seconds"), 1690000000);
  EXPECT_EQ(e.samples.at("kiln_store_damaged_results_total"), 3);
  EXPECT_EQ(e.samples.at("kiln_certificate_expiry_timestamp_seconds"), 1800000000);
  EXPECT_EQ(e.samples.at("kiln_clock_doubted"), 0);
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
  std::ofstream(file) << write_metrics(test::FakeFarm().source());
  const auto checked = test::run_command("promtool check metrics < " + file.string());
  EXPECT_EQ(checked.exit_status, 0) << checked.output;
  EXPECT_EQ(checked.output, "");
}

TEST(Metrics, AHeldStoreShows) {
  test::FakeFarm fake;
  fake.health.held_for = "no space is left on the disk";
  EXPECT_EQ(read_exposition(write_metrics(fake.source())).samples.at("kiln_store_held"), 1);
}

// The numbers of a farm that is too young or has no certificate are absent, not zero.
TEST(Metrics, SayNothingThatIsNotKnown) {
  test::FakeFarm fake;
  fake.health.tls = false;
  fake.health.data.bytes_a_day.reset();
  fake.health.data.days_until_full.reset();
  fake.health.clock_doubt = "the clock reads 2040-01-01";
  const std::string metrics = write_metrics(fake.source());
  for (const char* name : {"kiln_certificate_expiry", "kiln_data_growth", "kiln_disk_full_in_seconds"})
    EXPECT_EQ(metrics.find(name), metrics.npos) << name;
  EXPECT_EQ(read_exposition(metrics).samples.at("kiln_clock_doubted"), 1);
}

std::string text_of_file(const char* file) {
  const auto bytes = read_file(test::source_dir() / file);
  EXPECT_TRUE(bytes) << file;
  return bytes ? std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()) : "";
}

// An alert on a metric that does not exist never fires.
TEST(Metrics, AlertsAndDashboardNameMetricsThatAreExported) {
  const Exposition e = read_exposition(write_metrics(test::FakeFarm().source()));
  static const std::regex name("kiln_[a-z0-9_]+");
  for (const char* file : {"configs/prometheus/kiln-alerts.yml", "configs/prometheus/kiln-alerts-test.yml",
                           "configs/grafana/kiln-dashboard.json"}) {
    const std::string text = text_of_file(file);
    std::set<std::string> named;
    for (auto it = std::sregex_iterator(text.begin(), text.end(), name); it != std::sregex_iterator(); ++it)
      named.insert(it->str());
    EXPECT_GE(named.size(), 8u) << file;
    for (const std::string& metric : named) EXPECT_TRUE(e.types.count(metric)) << file << " names " << metric;
  }
  EXPECT_TRUE(parse_json(text_of_file("configs/grafana/kiln-dashboard.json")));
}

TEST(Metrics, EveryAlertFiresWhereItShouldAndNowhereElse) {
  static const std::regex alert("- alert: (\\w+)");
  const std::string rules = text_of_file("configs/prometheus/kiln-alerts.yml"),
                    tests = text_of_file("configs/prometheus/kiln-alerts-test.yml");
  for (auto it = std::sregex_iterator(rules.begin(), rules.end(), alert); it != std::sregex_iterator(); ++it)
    EXPECT_NE(tests.find("alertname: " + (*it)[1].str()), tests.npos) << (*it)[1] << " has no test";
  if (test::run_command("command -v promtool").exit_status != 0)
    GTEST_SKIP() << "promtool (Debian: prometheus) is not installed";
  const std::string folder = (test::source_dir() / "configs/prometheus").string();
  for (const char* check : {"check rules kiln-alerts.yml", "test rules kiln-alerts-test.yml"}) {
    const auto checked = test::run_command("cd '" + folder + "' && promtool " + check);
    EXPECT_EQ(checked.exit_status, 0) << checked.output;
  }
}

}  // namespace
}  // namespace kiln
