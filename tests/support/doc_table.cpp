#include "tests/support/doc_table.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "common/base/files.h"
#include "tests/support/paths.h"

namespace kiln::test {
namespace {

std::string read_page(const std::string& page) {
  const auto bytes = read_file(source_dir() / page);
  return bytes ? std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()) : "";
}

}  // namespace

DocTable::DocTable(std::string page) : page_(std::move(page)) {
  const std::string all = read_page(page_);
  const size_t from = all.find(kBegin), to = all.find(kEnd);
  if (from != std::string::npos && to != std::string::npos)
    text_ = all.substr(from + std::string(kBegin).size(), to - from - std::string(kBegin).size());
}

size_t DocTable::rows() const {
  const auto lines = std::count(text_.begin(), text_.end(), '\n');
  return lines < 2 ? 0 : static_cast<size_t>(lines - 2);
}

std::vector<std::string> DocTable::cells_of(const std::string& first) const {
  const size_t from = text_.find("| " + first + " | ");
  if (from == std::string::npos) return {};
  const std::string line = text_.substr(from, text_.find('\n', from) - from);
  std::vector<std::string> cells;
  for (size_t at = 2, next; (next = line.find(" |", at)) != std::string::npos; at = next + 3)
    cells.push_back(line.substr(at, next - at));
  return cells;
}

bool DocTable::replace(const std::string& table) const {
  std::string all = read_page(page_);
  const size_t from = all.find(kBegin), to = all.find(kEnd);
  if (from == std::string::npos || to == std::string::npos) return false;
  const size_t begin = from + std::string(kBegin).size();
  all.replace(begin, to - begin, table);
  return write_file_atomic(source_dir() / page_, all).has_value();
}

double DocTable::number(const std::string& cell) {
  double v = std::nan("");
  std::from_chars(cell.data(), cell.data() + cell.size(), v);
  return v;
}

}  // namespace kiln::test
