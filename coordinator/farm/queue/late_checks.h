// What an opening leaves for later, because it takes longer the more results are stored and nothing needs it
// before: the structure of the large tables, and spool files that are longer than their rows, or have none,
// after a crash. (A record is checked whenever it is read, late or not.)
//
// In steps on the writer's thread, when nothing else is to be written.
#pragma once

#include <filesystem>
#include <vector>

#include "coordinator/farm/queue/records.h"
#include "coordinator/farm/queue/sqlite.h"

namespace kiln {

// Fails (kIo, with the way out) unless SQLite finds the pages of the small tables intact, which an opening
// reads.
Status check_small_tables(Database& database);

class LateChecks {
 public:
  // `epoch`: this opening's, whose spool files are left alone. `jobs`: those of the store.
  LateChecks(std::filesystem::path spool, uint64_t epoch, std::vector<JobId> jobs);

  bool left() const { return table_ < kTables || job_ < jobs_.size(); }
  // The next step. An error: the database is damaged, and nothing may be written to it.
  Status step(Database& database);

 private:
  static constexpr size_t kTables = 2;  // large ones
  std::filesystem::path spool_;
  uint64_t epoch_ = 0;
  std::vector<JobId> jobs_;
  size_t table_ = 0, job_ = 0;  // the next
};

}  // namespace kiln
