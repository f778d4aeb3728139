// The farm's metrics in Prometheus' text format 0.0.4 (prometheus.io/docs/instrumenting/exposition_formats).
// Names are kiln_*, with their unit; counters end in _total. There is no series per worker, because workers
// come and go; /api/status.json lists them.
#pragma once

#include <string>

#include "coordinator/farm/documents/farm_source.h"

namespace kiln {

inline constexpr const char* kMetricsType = "text/plain; version=0.0.4; charset=utf-8";

std::string write_metrics(const FarmSource& source);
std::string escape_label(const std::string& value);

}  // namespace kiln
