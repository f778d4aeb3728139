// Carries out the ledger's actions.
#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/log.h"
#include "coordinator/farm/dispatch/server.h"

namespace kiln {

// Actions from events during the loop are queued behind the current ones.
void Server::perform(Actions&& actions) {
  KILN_CHECK(std::this_thread::get_id() == thread_);
  for (Action& action : actions) todo_.push_back(std::move(action));
  if (performing_) return;
  performing_ = true;
  while (!todo_.empty()) {
    const Action action = std::move(todo_.front());
    todo_.pop_front();
    carry_out(action);
  }
  KILN_CHECK(todo_.empty());
  performing_ = false;
}

void Server::carry_out(const Action& action) {
  const auto tell = [this](WorkerId worker, const Message& message) {
    if (Session* session = session_of(worker)) session->send(message);
  };
  const auto port_of = [this](JobId job) -> JobPort* {
    OpenJob* open = find_job(job);
    return open ? open->port.get() : nullptr;
  };
  std::visit(Overloaded{
                 [&](const Assign& a) {
                   if (const OpenJob* job = find_job(a.job)) tell(a.worker, Job{job->spec});
                 },
                 [&](const Release& a) {
                   tell(a.worker, JobEnded{a.job, a.reason});
                 },
                 [&](const Grant& a) {
                   const OpenJob* job = find_job(a.job);
                   const WorkUnit* unit = job && job->units ? job->units->find(a.unit) : nullptr;
                   if (unit) give(a.worker, {a.job, a.lease, *unit});
                 },
                 [&](const Recall& a) {
                   tell(a.worker, Withdraw{a.job, {a.unit}});
                 },
                 [&](const StoreAnswer& a) { store(a); },
                 [&](const Settle& a) { store_.settle(a); },
                 [&](const Deliver& a) {
                   const auto it = arrived_.find({a.job, a.unit, a.digest});
                   if (JobPort* port = port_of(a.job))
                     port->push(DeliveredUnit{a.unit, a.digest, it == arrived_.end() ? nullptr : it->second});
                 },
                 [&](const Revoke& a) { store_.revoke(a); },
                 [&](const Rewind& a) {
                   note(a.job, a.reason);
                   if (JobPort* port = port_of(a.job)) port->push(PassEnded{PassEnd::kRewound});
                 },
                 [&](const PinClass& a) { store_.pin_class(a.job, a.numeric_class); },
                 [&](const Acknowledge& a) {
                   tell(a.worker, CommitAck{a.job, a.unit, a.digest});
                 },
                 [&](const Trust& a) { store_.trust(a); },
                 [&](const Quarantine& a) { store_.quarantine(a); },
                 [&](const Expel& a) { expel(a.worker, a.reason); },
                 [&](const SkipUnit& a) {
                   note(a.job, a.reason);
                   if (JobPort* port = port_of(a.job)) port->push(SkippedUnit{a.unit, a.reason});
                 },
                 [&](const FailJob& a) { fail_job(a.job, a.error); },
                 [&](const PassComplete& a) {
                   if (JobPort* port = port_of(a.job)) port->push(PassEnded{PassEnd::kComplete});
                 },
                 [&](const Note& a) { note(a.job, a.text); },
             },
             action);
}

void Server::give(WorkerId worker, const kiln::Unit& unit) {
  if (Session* session = session_of(worker)) session->send(unit);
}

void Server::store(const StoreAnswer& answer) {
  const auto it = arrived_.find({answer.job, answer.unit, answer.digest});
  if (it == arrived_.end()) return;  // its job ended in the same batch
  KILN_CHECK(it->second && it->second->unit == answer.unit);
  store_.put(answer, it->second, [this, answer, alive = alive_] {
    if (std::this_thread::get_id() == thread_) return on_stored(answer);
    const std::lock_guard lock(alive->mutex);
    if (alive->timing) alive->timing->post([this, answer] { on_stored(answer); });
  });
}

void Server::on_stored(const StoreAnswer& answer) {
  KILN_CHECK(std::this_thread::get_id() == thread_);
  Actions actions;
  ledger_.stored(answer.job, answer.unit, answer.ticket, timing_.now_ms(), actions);
  perform(std::move(actions));
  // Deliver from memory if this settled it; wait while other actions are queued.
  if (performing_)
    timing_.post([this, answer] { arrived_.erase({answer.job, answer.unit, answer.digest}); });
  else
    arrived_.erase({answer.job, answer.unit, answer.digest});
}

void Server::expel(WorkerId worker, const std::string& reason, Parting parting) {
  Session* session = session_of(worker);
  if (!session) return;
  ++expelled_count_;
  note(0, text("{} is refused: {}", session->name(), reason));
  KILN_CHECK(members_.count(worker) == 1);
  expelled_[members_.at(worker).instance] = reason;
  members_.erase(worker);
  parting == Parting::kCut ? session->cut(reason) : session->refuse(reason);
  Actions actions;
  ledger_.leave(worker, false, reason, timing_.now_ms(), actions);
  perform(std::move(actions));
}

}  // namespace kiln
