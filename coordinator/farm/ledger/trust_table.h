// Whom the farm believes: identities of workers, the voters that answer for them, how often each agreed with
// another, and who is quarantined.
//
// Invariant: a name has one identity and an identity one name; a known voter of an identity is one of the
// voters ever named; an identity is quarantined exactly while there is a reason.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "coordinator/farm/ledger/actions.h"
#include "coordinator/farm/ledger/rules.h"

namespace kiln {

using IdentityId = uint32_t;
using VoterId = uint32_t;

class TrustTable {
 public:
  static constexpr VoterId kUnknownVoter = 0;
  struct Identity {
    std::string name;
    VoterId voter = kUnknownVoter;
    uint64_t agreed = 0;
    bool quarantined = false;
    std::string reason;
  };

  explicit TrustTable(const FarmRules& rules) : rules_(rules) {}

  IdentityId intern(const std::string& name);
  void set_voter(IdentityId id, const std::string& voter);
  // It votes for itself unless its voter is known already.
  void presume_own_voter(IdentityId id);
  void restore(const std::string& name, uint64_t agreed, const std::string& quarantined_for);
  void agree(IdentityId id, Actions& out);
  // False: it was quarantined before.
  bool quarantine(IdentityId id, const std::string& reason, Actions& out);

  const Identity& at(IdentityId id) const { return identities_[id]; }
  const std::string* quarantined_for(const std::string& name) const;  // nullptr: not quarantined
  bool same_voter(IdentityId a, IdentityId b) const;
  // How many different voters these are.
  size_t votes(const std::vector<IdentityId>& voters) const;
  bool is_among(const std::vector<IdentityId>& voters, IdentityId who) const;  // its voter, that is
  // Equal votes that a unit needs whose first answer is `first`'s. `alone`: nobody else could answer.
  uint32_t needed_votes(JobId job, uint64_t unit, uint32_t quorum, IdentityId first, bool alone) const;

  // What breaks the invariant, in words; empty: nothing.
  std::string audit() const;

 private:
  VoterId intern_voter(const std::string& name);

  const FarmRules& rules_;
  std::vector<Identity> identities_;
  std::map<std::string, IdentityId> identity_by_name_;
  std::map<std::string, VoterId> voter_by_name_;
};

}  // namespace kiln
