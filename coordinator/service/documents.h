// Records as JSON, the same for requests and for HTTP.
#pragma once

#include <string>

#include "common/base/json.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

class ServiceImpl;

struct JobsPage {
  JobId before = 0;  // 0: start at the newest
  size_t most = 200;
};
std::string jobs_document(ServiceImpl& service, const JobsPage& page);  // newest first
Expected<std::string> job_document(ServiceImpl& service, JobId id);     // with its files and events
std::string workers_document(ServiceImpl& service);
std::string status_document(ServiceImpl& service);
std::string events_document(ServiceImpl& service, uint64_t cursor, JobId job);

}  // namespace kiln
