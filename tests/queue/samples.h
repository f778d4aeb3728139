// Records, results and a store to put them in.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "coordinator/farm/queue/store.h"

namespace kiln::test {

// A fresh folder in memory where there is such a place: a process that dies loses nothing there either, and
// thousands of syncs cost nothing. Removed at the end.
class MemoryDir {
 public:
  MemoryDir();
  ~MemoryDir();
  MemoryDir(const MemoryDir&) = delete;
  MemoryDir& operator=(const MemoryDir&) = delete;
  const std::filesystem::path& path() const { return path_; }

 private:
  std::filesystem::path path_;
};

JobRecord sample_job(const std::string& name = "kitchen");  // every field differs from its default
Bytes sample_payload(uint64_t unit, size_t size);
UnitCommit sample_commit(JobId job, uint64_t unit, const Bytes& payload);

// Flips one bit in the middle of a file, in place, as a failing disk does.
void flip_bit(const std::filesystem::path& file);

std::unique_ptr<Store> open_store(const std::filesystem::path& folder, const StoreOptions& options = {});

// Of a store that can be read.
std::vector<CommitRow> rows_of(Store& store, JobId job);

// Stores a result and waits.
Status commit_now(Store& store, const UnitCommit& commit, const Bytes& payload);
Status commit_now(Store& store, JobId job, uint64_t unit, size_t size = 100);

// Calls ask(callback) and waits for the callback.
template <class Ask>
Status wait_for(const Ask& ask);

}  // namespace kiln::test

#include <future>

template <class Ask>
kiln::Status kiln::test::wait_for(const Ask& ask) {
  std::promise<Status> promise;
  ask([&](Status status) { promise.set_value(std::move(status)); });
  return promise.get_future().get();
}
