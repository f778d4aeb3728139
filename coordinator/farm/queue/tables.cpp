#include "coordinator/farm/queue/tables.h"

#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/queue/table_lists.h"

namespace kiln {

Status Tables::set_epoch(uint64_t epoch, const std::string& release) {
  KILN_CHECK(epoch > 0);
  KILN_TRY_STATUS(database_.run("UPDATE about SET value=?1 WHERE key='epoch'", epoch));
  return database_.run("UPDATE about SET value=?1 WHERE key='release'", std::string_view(release));
}

Expected<uint64_t> Tables::load_epoch() {
  Query query = database_.ask("SELECT value FROM about WHERE key='epoch'");
  KILN_TRY(const bool row, query.next());
  if (!row) return fail(ErrorKind::kIo, text("{} has no epoch: it is damaged", database_.path().string()));
  return query.number();
}

Status Tables::add_event(JobId job, int64_t at_ms, std::string_view text, uint32_t kept) {
  KILN_CHECK(kept > 0);
  KILN_TRY_STATUS(database_.run("INSERT INTO events(job,at_ms,text) VALUES(?1,?2,?3)", job, at_ms, text));
  return database_.run(
      "DELETE FROM events WHERE job=?1 AND id<="
      "(SELECT id FROM events WHERE job=?1 ORDER BY id DESC LIMIT 1 OFFSET ?2)",
      job, kept);
}

Expected<std::vector<JobEvent>> Tables::load_events(JobId job) {
  std::vector<JobEvent> events;
  Query query = database_.ask("SELECT at_ms,text FROM events WHERE job=?1 ORDER BY id", job);
  for (;;) {
    KILN_TRY(const bool row, query.next());
    if (!row) return events;
    JobEvent& event = events.emplace_back();
    event.at_ms = query.integer();
    event.text = query.string();
  }
}

Status Tables::put_pass(JobId job, const PassRecord& pass) {
  {
    Query query = database_.ask("SELECT cut FROM passes WHERE job=?1 AND pass=?2", job, pass.pass);
    KILN_TRY(const bool row, query.next());
    if (row) {
      const uint64_t cut = query.number();
      if (cut == pass.cut) return {};
      return fail(ErrorKind::kInvalidInput,
                  text("pass {} of job {} is cut by {}: it cannot be cut again by {}", pass.pass, job, cut,
                       pass.cut));
    }
  }
  return database_.run("INSERT INTO passes VALUES(?1,?2,?3)", job, pass.pass, pass.cut);
}

Expected<std::vector<PassRecord>> Tables::load_passes(JobId job) {
  std::vector<PassRecord> passes;
  Query query = database_.ask("SELECT pass,cut FROM passes WHERE job=?1 ORDER BY pass", job);
  for (;;) {
    KILN_TRY(const bool row, query.next());
    if (!row) return passes;
    PassRecord& pass = passes.emplace_back();
    pass.pass = static_cast<uint32_t>(query.integer());
    pass.cut = query.number();
  }
}

Status Tables::put_worker(const WorkerRecord& w) {
  const Bytes classes = write_list(w.numeric_classes);
  return database_.run("INSERT OR REPLACE INTO workers VALUES(?1,?2,?3,?4,?5,?6,?7,?8,?9,?10)",
                       std::string_view(w.identity), w.first_seen_ms, w.last_seen_ms, w.threads,
                       std::span<const std::byte>(classes), w.good_verifications, w.units, w.failures,
                       w.quarantined, std::string_view(w.quarantine_reason));
}

Expected<std::map<std::string, WorkerRecord>> Tables::load_workers() {
  std::map<std::string, WorkerRecord> workers;
  Query query = database_.ask(
      "SELECT identity,first_seen_ms,last_seen_ms,threads,numeric_classes,good_verifications,units,failures,"
      "quarantined,quarantine_reason FROM workers");
  for (;;) {
    KILN_TRY(const bool row, query.next());
    if (!row) return workers;
    WorkerRecord w;
    w.identity = query.string();
    w.first_seen_ms = query.integer();
    w.last_seen_ms = query.integer();
    w.threads = static_cast<uint32_t>(query.integer());
    if (!read_list(query.blob(), w.numeric_classes))
      return fail(ErrorKind::kIo,
                  text("{}: the record of worker {} is damaged", database_.path().string(), w.identity));
    w.good_verifications = query.number();
    w.units = query.number();
    w.failures = query.number();
    w.quarantined = query.integer() != 0;
    w.quarantine_reason = query.string();
    workers.emplace(w.identity, std::move(w));
  }
}

}  // namespace kiln
