#include "common/probes/probe_points.h"

#include "common/base/format.h"

namespace kiln {

Bytes write_probe_points(const ProbePoints& points) {
  return write_fields(points);
}

Expected<ProbePoints> read_probe_points(std::span<const std::byte> bytes) {
  KILN_TRY(ProbePoints out, read_fields<ProbePoints>(bytes, ErrorKind::kInvalidInput, "chunk of probes"));
  if (out.points.empty()) return fail(ErrorKind::kInvalidInput, "a chunk of probes has none");
  for (size_t i = 0; i < out.points.size(); ++i)
    if (!is_finite(out.points[i].position) || !(out.points[i].reach > 0) ||
        !std::isfinite(out.points[i].reach))
      return fail(ErrorKind::kInvalidInput, text("probe {} of a chunk has no place or no reach", i));
  return out;
}

}  // namespace kiln
