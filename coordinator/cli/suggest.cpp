#include "coordinator/cli/suggest.h"

#include <algorithm>

namespace kiln {
namespace {

size_t mistakes(const std::string& a, const std::string& b) {
  // Three rows of the table of prefixes; `older` is for neighbours that are exchanged.
  std::vector<size_t> older(b.size() + 1), last(b.size() + 1), row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    older.swap(last);
    last.swap(row);
    row[0] = i;
    for (size_t j = 1; j <= b.size(); ++j) {
      row[j] = std::min({last[j] + 1, row[j - 1] + 1, last[j - 1] + (a[i - 1] != b[j - 1])});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], older[j - 2] + 1);
    }
  }
  return row[b.size()];
}

}  // namespace

std::string nearest_word(const std::string& word, const std::vector<std::string>& candidates) {
  std::string best;
  size_t fewest = 0;
  for (const std::string& candidate : candidates) {
    const size_t count = mistakes(word, candidate);
    if (count > std::max<size_t>(1, candidate.size() / 3) || (!best.empty() && count >= fewest)) continue;
    best = candidate;
    fewest = count;
  }
  return best;
}

}  // namespace kiln
