#include "coordinator/farm/ledger/trust_table.h"

#include <algorithm>
#include <cmath>

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {
namespace {

// Uniform in [0, 1), the same for the same unit.
double draw(uint64_t seed, JobId job, uint64_t unit) {
  const uint64_t key[3] = {seed, job, unit};
  return std::ldexp(static_cast<double>(xxh3(std::as_bytes(std::span(key))) >> 11), -53);
}

}  // namespace

IdentityId TrustTable::intern(const std::string& name) {
  const auto [it, added] = identity_by_name_.try_emplace(name, static_cast<IdentityId>(identities_.size()));
  if (added) identities_.push_back({name, kUnknownVoter, 0, false, ""});
  return it->second;
}

VoterId TrustTable::intern_voter(const std::string& name) {
  return voter_by_name_.try_emplace(name, static_cast<VoterId>(voter_by_name_.size() + 1)).first->second;
}

void TrustTable::set_voter(IdentityId id, const std::string& voter) {
  KILN_CHECK(id < identities_.size());
  identities_[id].voter = intern_voter(voter);
}

void TrustTable::presume_own_voter(IdentityId id) {
  KILN_CHECK(id < identities_.size());
  if (identities_[id].voter == kUnknownVoter) identities_[id].voter = intern_voter(identities_[id].name);
}

void TrustTable::restore(const std::string& name, uint64_t agreed, const std::string& quarantined_for) {
  Identity& identity = identities_[intern(name)];
  identity.agreed = agreed;
  identity.quarantined = !quarantined_for.empty();
  identity.reason = quarantined_for;
}

void TrustTable::agree(IdentityId id, Actions& out) {
  KILN_CHECK(id < identities_.size());
  out.push_back(Trust{identities_[id].name, ++identities_[id].agreed});
}

bool TrustTable::quarantine(IdentityId id, const std::string& reason, Actions& out) {
  KILN_CHECK(id < identities_.size() && !reason.empty());
  Identity& identity = identities_[id];
  if (identity.quarantined) return false;
  identity.quarantined = true;
  identity.reason = reason;
  out.push_back(Quarantine{identity.name, reason});
  out.push_back(Note{0, text("{} is quarantined: {}", identity.name, reason)});
  return true;
}

const std::string* TrustTable::quarantined_for(const std::string& name) const {
  const auto it = identity_by_name_.find(name);
  if (it == identity_by_name_.end() || !identities_[it->second].quarantined) return nullptr;
  return &identities_[it->second].reason;
}

bool TrustTable::same_voter(IdentityId a, IdentityId b) const {
  return a == b || (identities_[a].voter != kUnknownVoter && identities_[a].voter == identities_[b].voter);
}

// A vote whose voter is not known may be anybody's, also one that is counted already: together all such votes
// count at most once, and only where there is no other.
size_t TrustTable::votes(const std::vector<IdentityId>& voters) const {
  size_t count = 0;
  for (size_t i = 0; i < voters.size(); ++i) {
    const VoterId voter = identities_[voters[i]].voter;
    const auto before = voters.begin() + static_cast<ptrdiff_t>(i);
    count += voter != kUnknownVoter && std::none_of(voters.begin(), before, [&](IdentityId other) {
               return identities_[other].voter == voter;
             });
  }
  return std::max<size_t>(count, voters.empty() ? 0 : 1);
}

bool TrustTable::is_among(const std::vector<IdentityId>& voters, IdentityId who) const {
  return std::any_of(voters.begin(), voters.end(), [&](IdentityId voter) { return same_voter(voter, who); });
}

uint32_t TrustTable::needed_votes(JobId job, uint64_t unit, uint32_t quorum, IdentityId first,
                                  bool alone) const {
  KILN_CHECK(quorum > 0 && first < identities_.size());
  if (quorum > 1) return quorum;
  if (rules_.audit_first == 0 || alone) return 1;
  const uint64_t agreed = identities_[first].agreed;
  if (agreed < rules_.audit_first) return 2;
  const double share = std::max(rules_.audit_least, 1.0 / static_cast<double>(agreed));
  return draw(rules_.audit_seed, job, unit) < share ? 2 : 1;
}

std::string TrustTable::audit() const {
  if (identities_.size() != identity_by_name_.size())
    return text("{} identities have {} names", identities_.size(), identity_by_name_.size());
  for (const auto& [name, id] : identity_by_name_)
    if (id >= identities_.size() || identities_[id].name != name)
      return text("the identity of {} has another name", name);
  for (const Identity& identity : identities_) {
    if (identity.voter > voter_by_name_.size())
      return text("nobody has named the voter of {}", identity.name);
    if (identity.quarantined == identity.reason.empty())
      return text("{} is quarantined without a reason, or has one and is not", identity.name);
  }
  return {};
}

}  // namespace kiln
