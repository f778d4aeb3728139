#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/queue/tables.h"

namespace kiln {
namespace {

CommitRow read_row(Query& query) {
  CommitRow row;
  row.job = query.number();
  row.unit = query.number();
  row.digest = query.digest();
  row.shape = query.number();
  row.worker = query.string();
  row.verified = query.integer() != 0;
  row.settled = query.integer() != 0;
  row.epoch = query.number();
  row.file = static_cast<uint32_t>(query.integer());
  row.offset = query.number();
  row.length = static_cast<uint32_t>(query.integer());
  return row;
}

Expected<std::vector<CommitRow>> read_rows(Query query) {
  std::vector<CommitRow> rows;
  for (;;) {
    KILN_TRY(const bool row, query.next());
    if (!row) return rows;
    rows.push_back(read_row(query));
  }
}

tl::unexpected<Error> no_result(JobId job, uint64_t unit, const Digest& digest) {
  return fail(ErrorKind::kInvalidInput,
              text("unit {} of job {} has no stored result {}", unit, job, digest.hex().substr(0, 16)));
}

}  // namespace

Expected<bool> Tables::has_result(const UnitCommit& commit) {
  Query query =
      database_.ask("SELECT 1 FROM unit_results WHERE job=?1 AND unit=?2 AND digest=?3 AND shape=?4",
                    commit.job, commit.unit, commit.digest, commit.shape);
  return query.next();
}

Status Tables::verify_result(const UnitCommit& commit) {
  return database_.run("UPDATE unit_results SET verified=1 WHERE job=?1 AND unit=?2 AND digest=?3",
                       commit.job, commit.unit, commit.digest);
}

Status Tables::add_result(const CommitRow& row) {
  KILN_CHECK(row.job != 0 && row.length <= kMaxPayloadBytes);
  return database_.run("INSERT OR REPLACE INTO unit_results VALUES(?1,?2,?3,?4,?5,?6,?7,?8,?9,?10,?11)",
                       row.job, row.unit, row.digest, row.shape, std::string_view(row.worker), row.verified,
                       row.settled, row.epoch, row.file, row.offset, row.length);
}

Status Tables::settle(JobId job, uint64_t unit, const Digest& winner, bool verified,
                      const std::string& worker) {
  KILN_TRY_STATUS(
      database_.run("UPDATE unit_results SET settled=1,verified=max(verified,?4),worker=iif(?5='',worker,?5) "
                    "WHERE job=?1 AND unit=?2 AND digest=?3",
                    job, unit, winner, verified, std::string_view(worker)));
  if (database_.changes() == 0) return no_result(job, unit, winner);
  return database_.run("DELETE FROM unit_results WHERE job=?1 AND unit=?2 AND digest<>?3", job, unit, winner);
}

Status Tables::revoke(JobId job, uint64_t unit) {
  return database_.run("DELETE FROM unit_results WHERE job=?1 AND unit=?2", job, unit);
}

Status Tables::revoke_answer(JobId job, uint64_t unit, const Digest& digest) {
  return database_.run("DELETE FROM unit_results WHERE job=?1 AND unit=?2 AND digest=?3", job, unit, digest);
}

Status Tables::note_unproven(JobId job) {
  // A job that is baked again has no results of its first bake.
  KILN_TRY_STATUS(database_.run("DELETE FROM unproven WHERE job=?1", job));
  return database_.run(
      "INSERT INTO unproven SELECT job,worker,count(*) FROM unit_results "
      "WHERE job=?1 AND settled=1 AND verified=0 GROUP BY worker",
      job);
}

namespace {

Expected<std::vector<Tables::Unproven>> read_unproven(Query query) {
  std::vector<Tables::Unproven> rows;
  for (;;) {
    KILN_TRY(const bool row, query.next());
    if (!row) return rows;
    Tables::Unproven& unproven = rows.emplace_back();
    unproven.job = query.number();
    unproven.worker = query.string();
    unproven.units = query.number();
  }
}

}  // namespace

Expected<std::vector<Tables::Unproven>> Tables::load_unproven(JobId job) {
  return read_unproven(
      database_.ask("SELECT job,worker,units FROM unproven WHERE job=?1 ORDER BY worker", job));
}

Expected<std::vector<Tables::Unproven>> Tables::load_unproven(const std::string& worker) {
  return read_unproven(database_.ask("SELECT job,worker,units FROM unproven WHERE worker=?1 ORDER BY job",
                                     std::string_view(worker)));
}

Status Tables::drop_results(JobId job) {
  KILN_TRY_STATUS(database_.run("DELETE FROM passes WHERE job=?1", job));
  return database_.run("DELETE FROM unit_results WHERE job=?1", job);
}

Expected<std::vector<CommitRow>> Tables::load_results(JobId job) {
  return read_rows(database_.ask(
      "SELECT job,unit,digest,shape,worker,verified,settled,epoch,file,offset,length FROM unit_results "
      "WHERE job=?1 ORDER BY unit,digest",
      job));
}

Expected<std::vector<CommitRow>> Tables::load_results_from(JobId job, uint64_t unit, const Digest& digest,
                                                           size_t most) {
  KILN_CHECK(most > 0);
  KILN_TRY(std::vector<CommitRow> rows,
           read_rows(database_.ask(
               "SELECT job,unit,digest,shape,worker,verified,settled,epoch,file,offset,length "
               "FROM unit_results WHERE job=?1 AND (unit,digest)>=(?2,?3) ORDER BY unit,digest LIMIT ?4",
               job, unit, digest, uint64_t{most})));
  if (rows.empty() || rows.front().unit != unit || rows.front().digest != digest)
    return no_result(job, unit, digest);
  return rows;
}

Expected<std::map<SpoolFileId, uint64_t>> Tables::load_spool_ends(JobId job, uint64_t epoch,
                                                                  uint64_t record_head) {
  std::map<SpoolFileId, uint64_t> ends;
  Query query = database_.ask(
      "SELECT epoch,file,max(offset+length) FROM unit_results WHERE job=?1 AND epoch<?2 GROUP BY epoch,file",
      job, epoch);
  for (;;) {
    KILN_TRY(const bool row, query.next());
    if (!row) return ends;
    SpoolFileId id{job};
    id.epoch = query.number();
    id.file = static_cast<uint32_t>(query.integer());
    ends[id] = query.number() + record_head;
  }
}

}  // namespace kiln
