// The store's operations on results of units.
#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/queue/store_impl.h"

namespace kiln {

void StoreImpl::commit_result(const UnitCommit& commit, std::shared_ptr<const Bytes> bytes, Callback done) {
  KILN_CHECK(commit.job != 0);
  Operation operation;
  if (!bytes) bytes = std::make_shared<const Bytes>();
  if (bytes->size() > kMaxPayloadBytes) {
    operation.apply = [size = bytes->size()](GroupTransaction&) -> Status {
      return fail(ErrorKind::kInvalidInput,
                  text("a result of {} bytes: {} are allowed", size, kMaxPayloadBytes));
    };
    return give(std::move(operation), std::move(done));
  }
  const auto payload = std::make_shared<Operation::Payload>();
  payload->commit = commit;
  payload->bytes = std::move(bytes);
  operation.payload = payload;
  operation.apply = [payload = payload.get()](GroupTransaction& t) -> Status {
    const UnitCommit& c = payload->commit;
    if (!t.has_job(c.job))
      return fail(ErrorKind::kInvalidInput, text("a result of job {}, which does not exist", c.job));
    KILN_TRY(const bool known, t.tables().has_result(c));
    if (known) return c.verified ? t.tables().verify_result(c) : Status();
    if (!payload->place)  // its job began in this group
      return fail(ErrorKind::kUnavailable, text("unit {} of job {}: give the result again", c.unit, c.job));
    const SpoolPlace& at = *payload->place;
    KILN_CHECK(payload->bytes->size() <= kMaxPayloadBytes);
    return t.tables().add_result({c.job, c.unit, c.shape, c.digest, c.worker, c.verified, false, at.epoch,
                                  at.file, at.offset, static_cast<uint32_t>(payload->bytes->size())});
  };
  give(std::move(operation), std::move(done));
}

void StoreImpl::settle(JobId job, uint64_t unit, const Digest& winner, bool verified,
                       const std::string& worker, Callback done) {
  Operation operation;
  operation.removes = true;
  operation.apply = [=, this](GroupTransaction& t) {
    windows_.forget(job);
    return t.tables().settle(job, unit, winner, verified, worker);
  };
  give(std::move(operation), std::move(done));
}

void StoreImpl::revoke_answer(JobId job, uint64_t unit, const Digest& digest, Callback done) {
  Operation operation;
  operation.removes = true;
  operation.apply = [=, this](GroupTransaction& t) {
    windows_.forget(job);
    return t.tables().revoke_answer(job, unit, digest);
  };
  give(std::move(operation), std::move(done));
}

void StoreImpl::revoke(JobId job, std::vector<uint64_t> units, Callback done) {
  Operation operation;
  operation.removes = true;
  operation.apply = [this, job, units = std::move(units)](GroupTransaction& t) -> Status {
    windows_.forget(job);
    for (const uint64_t unit : units) KILN_TRY_STATUS(t.tables().revoke(job, unit));
    return {};
  };
  give(std::move(operation), std::move(done));
}

void StoreImpl::drop_results(JobId job, Callback done) {
  Operation operation;
  operation.removes = true;
  operation.apply = [this, job](GroupTransaction& t) {
    windows_.forget(job);
    return t.tables().drop_results(job);
  };
  operation.after = [this, job]() -> Status {
    writer_.spool().drop(job);
    return {};
  };
  give(std::move(operation), std::move(done));
}

void StoreImpl::put_pass(JobId job, const PassRecord& pass, Callback done) {
  Operation operation;
  operation.apply = [=](GroupTransaction& t) -> Status {
    if (!t.has_job(job))
      return fail(ErrorKind::kInvalidInput, text("a pass of job {}, which does not exist", job));
    return t.tables().put_pass(job, pass);
  };
  give(std::move(operation), std::move(done));
}

}  // namespace kiln
