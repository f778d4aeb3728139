#include "coordinator/farm/queue/schema.h"

#include <filesystem>

#include "common/base/format.h"

namespace kiln {
namespace fs = std::filesystem;

std::span<const char* const> store_schema() {
  // 64-bit numbers keep their bits: those above 2^63 appear negative. Lists are byte streams (table_lists.h),
  // because no query needs single elements.
  static constexpr const char* kSteps[] = {R"sql(
CREATE TABLE about(key TEXT PRIMARY KEY, value) WITHOUT ROWID;
INSERT INTO about VALUES('epoch', 0), ('release', '');
CREATE TABLE jobs(
  id INTEGER PRIMARY KEY AUTOINCREMENT, name TEXT, user TEXT, priority INTEGER, state INTEGER, paused INTEGER,
  reason TEXT, quorum INTEGER, poison INTEGER, preparations INTEGER, submitted_ms INTEGER, started_ms INTEGER,
  ended_ms INTEGER, passes_done INTEGER, units_done INTEGER, units_total INTEGER, texels INTEGER,
  worst_relative_error REAL, converged_share REAL, tainted INTEGER, taint TEXT,
  scene TEXT, settings TEXT, after BLOB, inputs BLOB, results BLOB);
CREATE TABLE events(id INTEGER PRIMARY KEY, job INTEGER, at_ms INTEGER, text TEXT);
CREATE INDEX events_of_job ON events(job, id);
CREATE TABLE unit_results(
  job INTEGER, unit INTEGER, digest BLOB, shape INTEGER, worker TEXT, verified INTEGER, settled INTEGER,
  epoch INTEGER, file INTEGER, offset INTEGER, length INTEGER, PRIMARY KEY(job, unit, digest)) WITHOUT ROWID;
CREATE TABLE passes(job INTEGER, pass INTEGER, cut INTEGER, PRIMARY KEY(job, pass)) WITHOUT ROWID;
CREATE TABLE workers(
  identity TEXT PRIMARY KEY, first_seen_ms INTEGER, last_seen_ms INTEGER, threads INTEGER, numeric_classes BLOB,
  good_verifications INTEGER, units INTEGER, failures INTEGER, quarantined INTEGER, quarantine_reason TEXT)
  WITHOUT ROWID;
)sql",
                                           R"sql(
ALTER TABLE jobs ADD COLUMN submission TEXT DEFAULT '';
ALTER TABLE jobs ADD COLUMN numeric_class TEXT DEFAULT '';
CREATE TABLE unproven(job INTEGER, worker TEXT, units INTEGER, PRIMARY KEY(job, worker)) WITHOUT ROWID;
CREATE INDEX jobs_of_submission ON jobs(submission);
CREATE INDEX unproven_of_worker ON unproven(worker);
)sql",
                                           R"sql(
ALTER TABLE jobs ADD COLUMN verification TEXT DEFAULT '';
)sql"};
  return kSteps;
}

Status check_schema(const fs::path& path, uint32_t version) {
  std::error_code code;
  const uint64_t size = fs::file_size(path, code);
  if (code || size == 0) return {};
  KILN_TRY(const DatabaseHeader header, read_database_header(path));
  // Until the first checkpoint a new database has its tables, and these two numbers, only in the log.
  if (header.application_id != kStoreApplication && (header.application_id || header.user_version))
    return fail(ErrorKind::kIo,
                text("{} is a database of another program: choose another folder", path.string()));
  if (header.user_version > version)
    return fail(
        ErrorKind::kUsage,
        text("{} was written by a newer release of Kiln (schema {}, this release knows {}): start that "
             "release, or choose another folder",
             path.string(), header.user_version, version));
  return {};
}

Status migrate(Database& database, std::span<const char* const> steps) {
  uint64_t version = 0;
  {
    Query query = database.ask("PRAGMA user_version");
    KILN_TRY_STATUS(query.next());
    version = query.number();
  }
  if (version > steps.size())
    return fail(ErrorKind::kUsage, text("{} was written by a newer release of Kiln (schema {}, this release "
                                        "knows {}): start that release, or choose another folder",
                                        database.path().string(), version, steps.size()));
  if (version == steps.size()) return {};
  KILN_TRY_STATUS(database.begin());
  const auto all = [&]() -> Status {
    for (uint64_t i = version; i < steps.size(); ++i) KILN_TRY_STATUS(database.script(steps[i]));
    KILN_TRY_STATUS(database.script(
        text("PRAGMA application_id={}; PRAGMA user_version={};", kStoreApplication, steps.size())));
    return database.commit();
  };
  if (Status status = all(); !status) {
    database.rollback();
    return status;
  }
  return database.checkpoint();
}

}  // namespace kiln
