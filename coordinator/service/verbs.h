// The requests of clients, as one table: verb, required role, handler. Handlers run on a pool
// thread and may wait for the disk.
#pragma once

#include <span>
#include <string>

#include "common/base/json.h"
#include "coordinator/service/people.h"

namespace kiln {

class ServiceImpl;
class ClientFiles;

struct Ask {
  ServiceImpl& service;
  const Caller& caller;
  const JsonValue& document;
  ClientFiles& files;  // this client's uploads and downloads
};

struct Verb {
  const char* name;
  Access access;
  bool changes;                                 // what it did goes to the audit log
  Expected<std::string> (*answer)(const Ask&);  // returns a JSON document
};

std::span<const Verb> verb_table();
// Fails with kUsage if the verb does not exist or is not for the caller, with kInvalidInput if the
// document is wrong.
Expected<std::string> answer(ServiceImpl& service, const Caller& caller, const std::string& verb,
                             const std::string& document, ClientFiles& files);

// verbs_jobs.cpp
Expected<std::string> verb_submit(const Ask& ask);
Expected<std::string> verb_jobs(const Ask& ask);
Expected<std::string> verb_job(const Ask& ask);
// verbs_change.cpp
Expected<std::string> verb_cancel(const Ask& ask);
Expected<std::string> verb_pause(const Ask& ask);
Expected<std::string> verb_resume(const Ask& ask);
Expected<std::string> verb_priority(const Ask& ask);
Expected<std::string> verb_retry(const Ask& ask);
Expected<std::string> verb_forget(const Ask& ask);
// verbs_files.cpp
Expected<std::string> verb_upload(const Ask& ask);
Expected<std::string> verb_uploaded(const Ask& ask);
Expected<std::string> verb_fetch(const Ask& ask);
// verbs_farm.cpp
Expected<std::string> verb_why(const Ask& ask);
Expected<std::string> verb_workers(const Ask& ask);
Expected<std::string> verb_forgive(const Ask& ask);
Expected<std::string> verb_status(const Ask& ask);
Expected<std::string> verb_enrol(const Ask& ask);
Expected<std::string> verb_events(const Ask& ask);

}  // namespace kiln
