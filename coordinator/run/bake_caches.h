// The irradiance caches of a bake, one for each replicate: made of its sums between passes and named by the
// units of those that follow (docs/samples.md, "The irradiance cache").
#pragma once

#include <span>
#include <vector>

#include "coordinator/bake/merge/accumulator.h"
#include "coordinator/run/bake_run.h"

namespace kiln {

class BakeCaches {
 public:
  // All must outlive this. `charts`, `misleading`: by site; the latter as of BakingTask.
  BakeCaches(const Atlas& atlas, std::span<const uint32_t> charts, std::span<const uint8_t> misleading,
             uint64_t seed, FarmJob& farm)
      : atlas_(atlas), charts_(charts), misleading_(misleading), seed_(seed), farm_(farm) {}

  // By replicate; empty before the first caches.
  std::span<const Digest> digests() const { return digests_; }
  bool empty() const { return digests_.empty(); }
  void clear() { digests_.clear(); }
  // From now on paths go on at these sites, as at misleading ones; `begin` forgets them.
  void leave_out(std::span<const uint32_t> sites);
  void begin();

  // From the first looks, interpolated for texels that they did not sample. Rough, but paths in a white scene
  // that end there take a fiftieth of the time of whole ones; better caches follow at once. `pass`: passes so
  // far, which the errors drawn are keyed by.
  void make_rough(const Accumulator& sums, uint32_t pass, uint32_t stride);
  // From the latest samples.
  void renew(Accumulator& sums, uint32_t pass);

 private:
  std::vector<IrradianceCache> of_latest(const Accumulator& sums, uint32_t pass) const;
  void publish(IrradianceCache cache);

  const Atlas& atlas_;
  const std::span<const uint32_t> charts_;
  const std::span<const uint8_t> misleading_;
  std::vector<uint32_t> left_out_;
  const uint64_t seed_;
  FarmJob& farm_;
  std::vector<Digest> digests_;
};

}  // namespace kiln
