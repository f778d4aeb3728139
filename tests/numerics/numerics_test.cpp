// Every row of docs/numerics.md, computed anew: the truth lies within the stated error, and the page says so.
// KILN_WRITE_DOCS=1 numerics_test --gtest_filter='NumericsPage*' writes the page's table.
#include "common/base/format.h"
#include "tests/numerics/cases.h"
#include "tests/support/doc_table.h"

namespace kiln {
namespace {

using test::all_cases;
using test::Case;
using test::DocTable;
using test::Measured;

const char* const kPage = "docs/numerics.md";

bool holds(const Measured& m) {
  return std::abs(m.measured - m.expected) <= m.error;
}
std::string row_of(const Case& c, const Measured& m) {
  return text("| {} | {} | {:.7g} | {:.7g} | {:.2g} | {} |\n", c.name, c.about, m.expected, m.measured,
              m.error, holds(m) ? "holds" : "fails");
}

class Numerics : public testing::TestWithParam<size_t> {};

TEST_P(Numerics, HoldsAndIsStated) {
  const Case& c = all_cases()[GetParam()];
  SCOPED_TRACE(c.name);
  const Measured m = c.run();
  EXPECT_EQ(holds(m), !c.fails) << row_of(c, m);
  if (::getenv("KILN_WRITE_DOCS")) return;
  const auto cells = DocTable(kPage).cells_of(c.name);
  ASSERT_EQ(cells.size(), 6u)
      << "the page has no such row: run with KILN_WRITE_DOCS=1 --gtest_filter='NumericsPage*'";
  EXPECT_EQ(cells[1], c.about);
  EXPECT_NEAR(DocTable::number(cells[2]), m.expected, m.error + 1e-6 * std::abs(m.expected));
  if (!c.fails)
    EXPECT_NEAR(DocTable::number(cells[3]), m.measured,
                m.error + DocTable::number(cells[4]) + 1e-6 * std::abs(m.measured));
  EXPECT_EQ(cells[5], c.fails ? "fails" : "holds");
}

INSTANTIATE_TEST_SUITE_P(All, Numerics, testing::Range<size_t>(0, all_cases().size()),
                         [](const auto& info) { return "Case" + std::to_string(info.param); });

TEST(NumericsPage, HasTheseRowsAndNoOthers) {
  if (::getenv("KILN_WRITE_DOCS")) {
    std::string rows =
        "| case | what is measured, and what its error is made of | expected | measured | stated error | "
        "verdict |\n"
        "|---|---|---|---|---|---|\n";
    for (const Case& c : all_cases()) {
      rows += row_of(c, c.run());
      std::printf("%s", rows.substr(rows.rfind('\n', rows.size() - 2) + 1).c_str());
    }
    ASSERT_TRUE(DocTable(kPage).replace(rows));
    return;
  }
  const DocTable table(kPage);
  EXPECT_EQ(table.rows(), all_cases().size());
  for (const Case& c : all_cases()) EXPECT_FALSE(table.cells_of(c.name).empty()) << c.name;
}

}  // namespace
}  // namespace kiln
