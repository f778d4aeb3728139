// Who may take part, and under which name.
#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/wire/limits.h"
#include "coordinator/farm/dispatch/server.h"

namespace kiln {

// Without TLS one token admits all workers, and names nobody; a lender's own token names the lender.
Expected<std::string> Server::owner_of(const Hello& hello, const Session& session) const {
  if (settings_.token.empty() && settings_.tls) return session.identity().name;
  std::string owner;
  bool known = !settings_.token.empty() && equal_secret(hello.token, settings_.token);
  for (const auto& [name, token] : settings_.owner_tokens) {
    if (token.empty() || !equal_secret(hello.token, token)) continue;
    known = true;
    owner = name;
  }
  if (!known)
    return fail(
        ErrorKind::kUsage,
        "the token is not this coordinator's: give the worker the coordinator's token with --token-file or "
        "KILN_TOKEN");
  return settings_.tls ? session.identity().name : owner;
}

// Everybody behind the shared token is one owner. Where no owners are known, machines vote; on this machine,
// processes, because one machine is all there is.
std::string Server::voter_of(const Member& member) const {
  if (!member.owner.empty()) return member.owner;
  if (settings_.rules.owners_known) return "(the shared token)";
  return member.session->loopback() ? member.identity : "(machine) " + member.session->caller();
}

Expected<WorkerId> Server::admit(const Hello& hello, Session& session) {
  const auto refuse = [&](const std::string& why) {
    ++refused_;
    note(0, text("{} is refused: {}", session.name(), why));
    return fail(ErrorKind::kUsage, why);
  };
  if (settings_.tls && !session.identity().has(Role::kWorker))
    return refuse(
        text("the certificate of {} has the roles {}, not worker: issue one with `kiln cert issue --role "
             "worker`",
             session.identity().name.empty() ? "nobody" : session.identity().name,
             role_list(session.identity().roles)));
  auto owner = owner_of(hello, session);
  if (!owner) return refuse(owner.error().message);
  if (hello.threads == 0 || hello.threads > kMaxWorkerThreads)
    return refuse(text("{} threads is not a possible number", hello.threads));
  if (const auto it = expelled_.find(hello.instance); it != expelled_.end()) return refuse(it->second);
  Member member;
  member.session = &session;
  member.instance = hello.instance;
  member.owner = std::move(*owner);
  member.identity = member.owner.empty()
                        ? text("{}, process {} ({:x})", hello.host, hello.pid, hello.instance)
                        : member.owner;
  if (const std::string* why = ledger_.quarantined_for(member.identity)) {
    const std::string reason = text("{} is quarantined: {}. `kiln workers --forgive {}` lets it come back",
                                    member.identity, *why, member.identity);
    return refuse(reason);
  }
  for (const auto& [id, other] : members_) {
    if (other.instance != hello.instance) continue;
    // The process closed a connection that we still consider open.
    Session* older = other.session;
    const WorkerId worker = id;
    Actions actions;
    ledger_.leave(worker, false, "it connected anew", clock_.now_ms(), actions);
    members_.erase(worker);
    older->goodbye("you connected anew");
    perform(std::move(actions));
    break;
  }
  const WorkerId worker = ++last_worker_;
  KILN_CHECK(worker != 0 && !members_.count(worker));  // numbers are not used again
  members_.emplace(worker, std::move(member));
  return worker;
}

Welcome Server::welcome(WorkerId worker) const {
  const auto lease = static_cast<uint32_t>(settings_.rules.lease_ms);
  return {worker, std::max(10u, lease / 4), lease};
}

void Server::on_admitted(Session& session) {
  KILN_CHECK(members_.count(session.worker()) == 1);
  const Member& member = members_.at(session.worker());
  WorkerTraits traits{member.identity, session.name(), session.hello().threads, member.instance};
  traits.owner = member.owner;
  traits.voter = voter_of(member);
  Actions actions;
  ledger_.join(session.worker(), traits, clock_.now_ms(), actions);
  perform(std::move(actions));
}

Expected<std::unique_ptr<ClientTalk>> Server::admit_client(const ClientHello& hello, Session& session) {
  if (!settings_.clients.admit)
    return fail(ErrorKind::kUsage, "this coordinator bakes one scene and has no queue");
  const std::string caller = session.caller();
  const auto its = std::count_if(sessions_.begin(), sessions_.end(), [&](const auto& entry) {
    return entry.first->is_client() && entry.first->caller() == caller;
  });
  if (static_cast<size_t>(its) >= kMaxClientsOfCaller)
    return fail(ErrorKind::kUnavailable, text("{} has {} connections already: end some, or try again later",
                                              caller, kMaxClientsOfCaller));
  auto talk = settings_.clients.admit(hello, session.identity(), session);
  if (!talk) {
    ++refused_;
    note(0, text("{} is refused: {}", session.name(), talk.error().message));
  }
  return talk;
}

}  // namespace kiln
