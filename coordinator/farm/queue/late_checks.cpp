#include "coordinator/farm/queue/late_checks.h"

#include <algorithm>
#include <array>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/farm/queue/open_file.h"
#include "coordinator/farm/queue/spool.h"
#include "coordinator/farm/queue/spool_record.h"
#include "coordinator/farm/queue/tables.h"

namespace kiln {
namespace {

// The query's rows are verdicts.
Status expect_ok(const Database& database, Query query) {
  for (;;) {
    KILN_TRY(const bool row, query.next());
    if (!row) return {};
    if (const std::string verdict = query.string(); verdict != "ok")
      return fail(ErrorKind::kIo,
                  text("the database {} is damaged ({}): restore it from a copy, or move the folder "
                       "away to begin anew",
                       database.path().string(), verdict));
  }
}

// ROOM: a table that grows with what is stored; it is left out of the first check.
constexpr std::array<const char*, 2> kLargeTables = {"events", "unit_results"};

}  // namespace

// An older schema has fewer tables, and a new file none.
Status check_small_tables(Database& database) {
  return expect_ok(database,
                   database.ask("SELECT c.quick_check FROM sqlite_schema s, pragma_quick_check(s.name) c "
                                "WHERE s.type='table' AND s.name NOT IN (?1,?2)",
                                std::string_view(kLargeTables[0]), std::string_view(kLargeTables[1])));
}

LateChecks::LateChecks(std::filesystem::path spool, uint64_t epoch, std::vector<JobId> jobs)
    : spool_(std::move(spool)), epoch_(epoch), jobs_(std::move(jobs)) {
  static_assert(kTables == kLargeTables.size());
  for (const auto& folder : list_folder(spool_))
    if (const auto job = spool_job(folder)) jobs_.push_back(*job);
  std::sort(jobs_.begin(), jobs_.end());
  jobs_.erase(std::unique(jobs_.begin(), jobs_.end()), jobs_.end());
}

Status LateChecks::step(Database& database) {
  KILN_CHECK(left());
  if (table_ < kLargeTables.size())
    return expect_ok(database, database.ask("SELECT quick_check FROM pragma_quick_check(?1)",
                                            std::string_view(kLargeTables[table_++])));
  const JobId job = jobs_[job_++];
  KILN_TRY(const auto ends, Tables(database).load_spool_ends(job, epoch_, kSpoolHead));
  for (const std::string& fault : tidy_spool(spool_, job, epoch_, ends)) log_warning(fault);
  return {};
}

}  // namespace kiln
