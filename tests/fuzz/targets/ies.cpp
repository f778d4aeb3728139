// A light profile.
#include "coordinator/scene/import/ies_profile.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_ies(std::span<const std::byte> data) {
  const auto profile = parse_ies(text_of(data));
  require_sentence(profile);
  if (!profile) return;
  require(profile->candela.size() == profile->vertical.size() * profile->horizontal.size(),
          "a value for every pair of angles");
  for (const double candela : profile->candela) require(candela >= 0, "no negative intensity");
}

}  // namespace kiln::fuzz
