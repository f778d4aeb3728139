// The farm as JSON, for the page and for programs.
#pragma once

#include <string>

#include "coordinator/farm/web/web_sources.h"

namespace kiln {

std::string status_json(const WebSources& sources);  // workers, active jobs, totals, store
std::string jobs_json(const WebSources& sources);    // every job in short
// With settings, inputs, results and events; nothing: there is no such job.
std::optional<std::string> job_json(const WebSources& sources, JobId id);
// Why nothing is handed out; empty: work goes on.
std::string unhealthy(const WebSources& sources);

}  // namespace kiln
