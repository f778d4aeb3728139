#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/queue/table_lists.h"
#include "coordinator/farm/queue/tables.h"

namespace kiln {

Expected<JobId> Tables::add_job(const JobRecord& job) {
  KILN_TRY_STATUS(database_.run("INSERT INTO jobs DEFAULT VALUES"));
  JobRecord numbered = job;
  numbered.id = database_.last_id();
  KILN_TRY_STATUS(set_job(numbered, true));
  return numbered.id;
}

Status Tables::set_job(const JobRecord& j, bool described) {
  KILN_CHECK(j.id != 0);
  KILN_TRY_STATUS(database_.run(
      "UPDATE jobs SET name=?2,user=?3,priority=?4,state=?5,paused=?6,reason=?7,quorum=?8,poison=?9,"
      "preparations=?10,submitted_ms=?11,started_ms=?12,ended_ms=?13,passes_done=?14,units_done=?15,"
      "units_total=?16,texels=?17,worst_relative_error=?18,converged_share=?19,tainted=?20,taint=?21,"
      "submission=?22,numeric_class=?23,verification=?24 WHERE id=?1",
      j.id, std::string_view(j.name), std::string_view(j.user), j.priority, static_cast<int64_t>(j.state),
      j.paused, std::string_view(j.reason), j.quorum, static_cast<int64_t>(j.poison), j.preparations,
      j.submitted_ms, j.started_ms, j.ended_ms, j.passes_done, j.units_done, j.units_total, j.texels,
      j.worst_relative_error, j.converged_share, j.tainted, std::string_view(j.taint),
      std::string_view(j.submission), std::string_view(j.numeric_class), std::string_view(j.verification)));
  if (!described) return {};
  const Bytes after = write_list(j.after), inputs = write_list(j.inputs), results = write_list(j.results);
  return database_.run("UPDATE jobs SET scene=?2,settings=?3,after=?4,inputs=?5,results=?6 WHERE id=?1", j.id,
                       std::string_view(j.scene), std::string_view(j.settings),
                       std::span<const std::byte>(after), std::span<const std::byte>(inputs),
                       std::span<const std::byte>(results));
}

Expected<JobId> Tables::find_submission(const std::string& user, const std::string& submission) {
  Query query = database_.ask("SELECT id FROM jobs WHERE submission=?1 AND user=?2",
                              std::string_view(submission), std::string_view(user));
  KILN_TRY(const bool row, query.next());
  return row ? query.number() : JobId{0};
}

Status Tables::remove_job(JobId job) {
  KILN_TRY_STATUS(database_.run("DELETE FROM events WHERE job=?1", job));
  KILN_TRY_STATUS(database_.run("DELETE FROM unproven WHERE job=?1", job));
  return database_.run("DELETE FROM jobs WHERE id=?1", job);
}

Expected<std::map<JobId, JobRecord>> Tables::load_jobs() {
  std::map<JobId, JobRecord> jobs;
  Query query = database_.ask(
      "SELECT id,name,user,priority,state,paused,reason,quorum,poison,preparations,submitted_ms,started_ms,"
      "ended_ms,passes_done,units_done,units_total,texels,worst_relative_error,converged_share,tainted,taint,"
      "submission,numeric_class,verification,scene,settings,after,inputs,results FROM jobs");
  for (;;) {
    KILN_TRY(const bool row, query.next());
    if (!row) return jobs;
    JobRecord j;
    j.id = query.number();
    j.name = query.string();
    j.user = query.string();
    j.priority = static_cast<int32_t>(query.integer());
    j.state = static_cast<JobState>(query.integer());
    j.paused = query.integer() != 0;
    j.reason = query.string();
    j.quorum = static_cast<uint32_t>(query.integer());
    j.poison = static_cast<PoisonPolicy>(query.integer());
    j.preparations = static_cast<uint32_t>(query.integer());
    j.submitted_ms = query.integer();
    j.started_ms = query.integer();
    j.ended_ms = query.integer();
    j.passes_done = static_cast<uint32_t>(query.integer());
    j.units_done = query.number();
    j.units_total = query.number();
    j.texels = query.number();
    j.worst_relative_error = query.real();
    j.converged_share = query.real();
    j.tainted = query.integer() != 0;
    j.taint = query.string();
    j.submission = query.string();
    j.numeric_class = query.string();
    j.verification = query.string();
    j.scene = query.string();
    j.settings = query.string();
    bool lists = read_list(query.blob(), j.after);
    lists = read_list(query.blob(), j.inputs) && lists;
    lists = read_list(query.blob(), j.results) && lists;
    if (!lists || !check_job(j))
      return fail(ErrorKind::kIo,
                  text("{}: the record of job {} is damaged", database_.path().string(), j.id));
    jobs.emplace(j.id, std::move(j));
  }
}

}  // namespace kiln
