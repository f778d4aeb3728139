// A service in this process with one local worker, and a person's program beside it.
#pragma once

#include <map>
#include <memory>
#include <string>

#include "coordinator/farm/client/service_client.h"
#include "coordinator/farm/snapshot/snapshot.h"
#include "coordinator/service/service.h"

namespace kiln::test {

struct ServiceHost {
  explicit ServiceHost(const std::filesystem::path& folder, uint32_t workers = 1, uint32_t active_jobs = 4);
  Expected<std::unique_ptr<Service>> start();
  void restart();
  std::unique_ptr<ServiceClient> client(const std::string& token_file = "admin.token",
                                        const std::string& user = "ada");
  std::string server() const;

  ServiceSettings settings;
  std::unique_ptr<Service> service;
};

BakeSettings quick_settings();
// The question "submit" for a snapshot; `more`: further members, as JSON text with a leading comma.
std::string submission(const Snapshot& snapshot, const std::string& key, const std::string& more = "");
// Asks, sends what is missing, asks again.
uint64_t submit(ServiceClient& client, const Snapshot& snapshot, const std::string& key,
                const std::string& more = "");
JsonValue ask(ServiceClient& client, const std::string& verb, const std::string& document);
std::string ask_error(ServiceClient& client, const std::string& verb, const std::string& document);
std::string state_of(ServiceClient& client, uint64_t id);
// Waits until the job is in one of the states; the state, or what it was after a minute.
std::string wait_for_state(ServiceClient& client, uint64_t id, const std::string& states);
// SHA-256 of the job's fetched files by name.
std::map<std::string, std::string> fetched(ServiceClient& client, uint64_t id,
                                           const std::filesystem::path& folder);

}  // namespace kiln::test
