// The farm in numbers, in Prometheus' text format 0.0.4
// (prometheus.io/docs/instrumenting/exposition_formats). Names are kiln_*, with their unit; what only rises
// while the coordinator runs ends in _total. There is no series per worker: a farm's workers come and go, and
// /api/status.json has them.
#pragma once

#include <string>

#include "coordinator/farm/web/web_sources.h"

namespace kiln {

inline constexpr const char* kMetricsType = "text/plain; version=0.0.4; charset=utf-8";

std::string write_metrics(const WebSources& sources);
std::string escape_label(const std::string& value);

}  // namespace kiln
