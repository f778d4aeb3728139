#include "coordinator/farm/ledger/verification.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {
namespace {

constexpr double kLiars = 0.1;  // the share of voters that the text speaks of
constexpr size_t kMaxNamed = 6;

std::string contributors_text(std::vector<Contribution> by) {
  std::stable_sort(by.begin(), by.end(), [](const auto& a, const auto& b) { return a.alone > b.alone; });
  std::string list;
  for (size_t i = 0; i < std::min(by.size(), kMaxNamed); ++i)
    list += text("{}{} gave {} ({} alone) and confirmed {}", i ? "; " : "", by[i].identity, by[i].gave,
                 by[i].alone, by[i].confirmed);
  if (by.size() > kMaxNamed) list += text("; and {} others", by.size() - kMaxNamed);
  return list;
}

}  // namespace

double unseen_probability(const Verification& v, double liars, uint64_t wrong) {
  const uint64_t all = v.verified + v.unverified;
  KILN_CHECK(liars >= 0 && liars <= 1);
  if (all == 0) return 1;
  const double checked = static_cast<double>(v.verified) / static_cast<double>(all);
  return std::pow(1 - checked * (1 - liars), static_cast<double>(wrong));
}

std::string verification_text(const Verification& v) {
  const uint64_t all = v.verified + v.unverified;
  if (all == 0) return "";
  const char* voter = v.owners_known ? "owner" : "machine";
  if (v.trusted && v.verified == 0)
    return text("none of {} unit results was checked: machines are trusted here", all);
  std::string words =
      text("{} of {} unit results were confirmed by another {}, {} by nobody ({} checks waived)", v.verified,
           all, voter, v.unverified, v.waived);
  if (v.quorum > 1) words += text("; a quorum of {} {}s was asked for", v.quorum, voter);
  words += text(
      "; if {:.0f} % of the {}s had colluded in 1, 10 or 100 wrong results, none would have been "
      "noticed with probability {:.2g}, {:.2g} or {:.2g}",
      100 * kLiars, voter, unseen_probability(v, kLiars, 1), unseen_probability(v, kLiars, 10),
      unseen_probability(v, kLiars, 100));
  if (!v.owners_known)
    words +=
        "; owners are not told apart here (one token for all workers), so machines of one owner count "
        "as different";
  return words + ". " + contributors_text(v.by);
}

}  // namespace kiln
