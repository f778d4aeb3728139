// The farm's state as JSON, for the page and for programs.
#pragma once

#include <string>

#include "coordinator/farm/web/web_sources.h"

namespace kiln {

std::string status_json(const WebSources& sources);  // workers, active jobs, totals, store
std::string jobs_json(const WebSources& sources);    // a summary of every job
// With settings, inputs, results and events; nullopt: no such job.
std::optional<std::string> job_json(const WebSources& sources, JobId id);
// Why no units are handed out; empty: they are.
std::string unhealthy(const WebSources& sources);

}  // namespace kiln
