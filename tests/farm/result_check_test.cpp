// Sums that no worker can have measured are refused, possible ones are not.
#include "coordinator/farm/dispatch/result_check.h"

namespace kiln {
namespace {

struct Sums {
  MomentLayout layout;
  WorkUnit unit{1, 0, 8, {5}};
  Result result;

  explicit Sums(const Quantities& quantities = {}) : layout(0, quantities) {
    result.result.unit = 1;
    result.result.site_count = 1;
    result.result.plane_count = static_cast<uint32_t>(layout.planes());
    result.result.moments.assign(layout.planes(), 1.0);
  }
  Status check() {
    result.digest = result_digest(result.result);
    return check_result(result, &unit, layout);
  }
};

TEST(ResultCheck, CountsAreWithinTheSamples) {
  Sums s;
  EXPECT_TRUE(s.check());
  s.result.result.moments[kMomentInside] = 9;
  EXPECT_FALSE(s.check());
}

// Light is not negative, but where paths end at a cache the rest of a closure beside its Lambert lobe is
// signed, and so may be the sum of a few samples. Squares never are.
TEST(ResultCheck, LightMayBeNegativeOnlyWhereACacheWasRead) {
  Sums s;
  s.result.result.moments[kMomentLum] = -0.25;
  EXPECT_FALSE(s.check());
  s.unit.cache = sha256({});
  EXPECT_TRUE(s.check());
  s.result.result.moments[kMomentLum2] = -0.25;
  EXPECT_FALSE(s.check());
}

// What came straight from an emitter is never negative; the sum for caches is as signed as E.
TEST(ResultCheck, PartsOfLightAreHeldToTheSame) {
  Quantities parts;
  parts.direct_apart = parts.all_light = true;
  Sums s(parts);
  EXPECT_TRUE(s.check());
  s.result.result.moments[s.layout.all_light() + 1] = -0.25;
  EXPECT_FALSE(s.check());
  s.unit.cache = sha256({});
  EXPECT_TRUE(s.check());
  s.result.result.moments[s.layout.direct() + 2] = -0.25;
  EXPECT_FALSE(s.check());
}

}  // namespace
}  // namespace kiln
