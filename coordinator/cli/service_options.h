// Options and helpers shared by all commands that talk to a service.
#pragma once

#include <functional>
#include <memory>
#include <vector>

#include "coordinator/cli/command.h"
#include "coordinator/farm/client/service_client.h"

namespace kiln {

// `own` plus the options that locate a service.
std::vector<Option> with_service_options(std::vector<Option> own);
Expected<std::unique_ptr<ServiceClient>> connect_service(const Arguments& arguments);

Expected<uint64_t> parse_id(const std::string& typed);  // a job id
Expected<int64_t> parse_whole(const std::string& name, const std::string& typed, int64_t least, int64_t most);
std::string id_document(uint64_t id);

// Members of a reply; empty or zero if missing. Texts are made printable: they are other people's.
std::string text_of(const JsonValue& value, const char* name);
double number_of(const JsonValue& value, const char* name);
uint64_t whole_of(const JsonValue& value, const char* name);
bool flag_of(const JsonValue& value, const char* name);
std::string time_text(uint64_t unix_ms);  // "2027-03-01 12:00", local; "-": never

// Exit status of a job by its state: 0 done, 1 failed or cancelled.
int status_of_state(const std::string& state);
// fetch.cpp: downloads all results of a job into a folder.
Status fetch_results(ServiceClient& client, uint64_t job, const std::string& folder, bool quiet);
// watch.cpp: follows a job until it has ended; 0: all jobs. Returns the exit status.
Expected<int> watch_jobs(ServiceClient& client, uint64_t job, bool json);

}  // namespace kiln
