// A table of a page in docs/ that a test computes: rows between two markers, found by their first cell.
#pragma once

#include <string>
#include <vector>

namespace kiln::test {

class DocTable {
 public:
  // `page`: relative to the repository; it must contain both markers, kBegin and kEnd.
  explicit DocTable(std::string page);
  static constexpr const char* kBegin = "<!-- table -->\n";
  static constexpr const char* kEnd = "<!-- end of table -->";

  size_t rows() const;  // without the two lines of the head
  // Cells of the row with this first cell; empty if there is none.
  std::vector<std::string> cells_of(const std::string& first) const;
  // Replaces the table, head included. False if the page has no markers or cannot be written.
  bool replace(const std::string& table) const;
  // A cell's leading number; NaN if there is none.
  static double number(const std::string& cell);

 private:
  std::string page_, text_;
};

}  // namespace kiln::test
