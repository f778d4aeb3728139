// The chunk of a job's probe points.
#include <algorithm>

#include "common/probes/probe_points.h"
#include "tests/fuzz/target.h"

namespace kiln::fuzz {

void fuzz_probes(std::span<const std::byte> data) {
  const auto points = read_probe_points(data);
  require_sentence(points);
  if (!points) return;
  for (const ProbePoint& p : points->points)
    require(is_finite(p.position) && p.reach > 0, "a probe that was read has a place and a reach");
  const Bytes again = write_probe_points(*points);
  require(std::equal(again.begin(), again.end(), data.begin(), data.end()),
          "points that were read are written as the same bytes");
}

}  // namespace kiln::fuzz
