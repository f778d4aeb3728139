// Every row of docs/numerics.md, computed anew: the truth lies within the stated error, and the page says so.
// KILN_WRITE_DOCS=1 numerics_test --gtest_filter='NumericsPage*' writes the page's table.
#include <charconv>

#include "common/base/files.h"
#include "common/base/format.h"
#include "tests/numerics/cases.h"

namespace kiln {
namespace {

using test::all_cases;
using test::Case;
using test::Measured;

const std::string kBegin = "<!-- table -->\n", kEnd = "<!-- end of table -->";

std::filesystem::path page_path() {
  return test::source_dir() / "docs/numerics.md";
}
std::string read_page() {
  const auto bytes = read_file(page_path());
  return bytes ? std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()) : "";
}
std::string table_of(const std::string& page) {
  const size_t from = page.find(kBegin), to = page.find(kEnd);
  if (from == std::string::npos || to == std::string::npos) return "";
  return page.substr(from + kBegin.size(), to - from - kBegin.size());
}

bool holds(const Measured& m) {
  return std::abs(m.measured - m.expected) <= m.error;
}
std::string row_of(const Case& c, const Measured& m) {
  return text("| {} | {} | {:.7g} | {:.7g} | {:.2g} | {} |\n", c.name, c.about, m.expected, m.measured,
              m.error, holds(m) ? "holds" : "fails");
}

// Cells of the page's row of this name.
std::vector<std::string> cells_of(const std::string& name) {
  const std::string table = table_of(read_page());
  const size_t from = table.find("| " + name + " | ");
  if (from == std::string::npos) return {};
  const std::string line = table.substr(from, table.find('\n', from) - from);
  std::vector<std::string> cells;
  for (size_t at = 2, next; (next = line.find(" |", at)) != std::string::npos; at = next + 3)
    cells.push_back(line.substr(at, next - at));
  return cells;
}
double number(const std::string& cell) {
  double v = std::nan("");
  std::from_chars(cell.data(), cell.data() + cell.size(), v);
  return v;
}

class Numerics : public testing::TestWithParam<size_t> {};

TEST_P(Numerics, HoldsAndIsStated) {
  const Case& c = all_cases()[GetParam()];
  SCOPED_TRACE(c.name);
  const Measured m = c.run();
  EXPECT_EQ(holds(m), !c.fails) << row_of(c, m);
  if (::getenv("KILN_WRITE_DOCS")) return;
  const auto cells = cells_of(c.name);
  ASSERT_EQ(cells.size(), 6u)
      << "the page has no such row: run with KILN_WRITE_DOCS=1 --gtest_filter='NumericsPage*'";
  EXPECT_EQ(cells[1], c.about);
  EXPECT_NEAR(number(cells[2]), m.expected, m.error + 1e-6 * std::abs(m.expected));
  if (!c.fails)
    EXPECT_NEAR(number(cells[3]), m.measured, m.error + number(cells[4]) + 1e-6 * std::abs(m.measured));
  EXPECT_EQ(cells[5], c.fails ? "fails" : "holds");
}

INSTANTIATE_TEST_SUITE_P(All, Numerics, testing::Range<size_t>(0, all_cases().size()),
                         [](const auto& info) { return "Case" + std::to_string(info.param); });

TEST(NumericsPage, HasTheseRowsAndNoOthers) {
  std::string page = read_page();
  if (::getenv("KILN_WRITE_DOCS")) {
    std::string rows =
        "| case | what is measured, and what its error is made of | expected | measured | stated error | "
        "verdict |\n"
        "|---|---|---|---|---|---|\n";
    for (const Case& c : all_cases()) {
      rows += row_of(c, c.run());
      std::printf("%s", rows.substr(rows.rfind('\n', rows.size() - 2) + 1).c_str());
    }
    const size_t from = page.find(kBegin) + kBegin.size();
    ASSERT_NE(page.find(kEnd), std::string::npos);
    page.replace(from, page.find(kEnd) - from, rows);
    ASSERT_TRUE(write_file_atomic(page_path(), page));
    return;
  }
  const std::string table = table_of(page);
  EXPECT_EQ(static_cast<size_t>(std::count(table.begin(), table.end(), '\n')), all_cases().size() + 2);
  for (const Case& c : all_cases()) EXPECT_NE(table.find("| " + c.name + " | "), std::string::npos) << c.name;
}

}  // namespace
}  // namespace kiln
