// How far a job's results were checked against liars and broken machines: the counts, by whom, and what they
// prove.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

namespace kiln {

// What one identity did for a job's results.
struct Contribution {
  std::string identity;
  uint64_t gave = 0;       // units whose result is its answer, and no earlier one's
  uint64_t alone = 0;      // of these, units that nobody else confirmed
  uint64_t confirmed = 0;  // units of others that it answered equally
  bool operator==(const Contribution&) const = default;
};

struct Verification {
  uint64_t verified = 0, unverified = 0;  // units, by whether another voter gave the same result
  uint64_t waived = 0;                    // of the unverified: checks that nobody was there to make
  uint32_t quorum = 1;                    // voters that had to agree on every unit
  bool owners_known = false;              // FarmRules::owners_known: voters are owners, not machines
  bool trusted = false;                   // nothing was to be checked (`--audit-first 0`, local bakes)
  std::vector<Contribution> by;           // by name
};

// The probability that `wrong` wrong results stay unnoticed, whose authors and accomplices are the share
// `liars` (0 to 1) of all voters: each is checked with the share of units that was, chosen in secret
// (needed_votes), and an accomplice confirms it. (1 - f (1 - liars))^wrong, f = verified / all.
double unseen_probability(const Verification& v, double liars, uint64_t wrong);

// Two or three sentences for people; empty if there are no results.
std::string verification_text(const Verification& v);

}  // namespace kiln
