// The farm as JSON, with one set of names for pages, clients and the command line. Times end in _ms (Unix) or
// _s, sizes in _bytes.
#pragma once

#include <optional>
#include <string>

#include "coordinator/farm/documents/farm_source.h"

namespace kiln {

struct JobsPage {
  JobId before = 0;  // 0: start at the newest
  size_t most = 200;
};
std::string jobs_document(const FarmSource& source, const JobsPage& page);  // newest first
// With settings, files and events; nullopt: no such job.
std::optional<std::string> job_document(const FarmSource& source, JobId id);
std::string workers_document(const FarmSource& source);
std::string status_document(const FarmSource& source);
// Why no units are handed out; empty: they are.
std::string held_for(const FarmSource& source);

}  // namespace kiln
