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
    ledger_.leave(worker, false, "it connected anew", timing_.now_ms(), actions);
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
  ledger_.join(session.worker(), traits, timing_.now_ms(), actions);
  perform(std::move(actions));
}

Expected<std::unique_ptr<ClientTalk>> Server::admit_client(const ClientHello& hello, Session& session) {
  if (!settings_.clients.admit)
    return fail(ErrorKind::kUsage, "this coordinator bakes one scene and has no queue");
  const std::string caller = session.caller();
  const auto its = std::count_if(sessions_.begin(), sessions_.end(), [&](const auto& other) {
    return other->is_client() && other->caller() == caller;
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

bool Server::cut_off(Session& session) {
  if (session.is_cut()) return true;
  const PeerIdentity& who = session.identity();
  if (!settings_.tls || who.serial.empty()) return false;
  const auto revoked = settings_.tls->is_revoked(who.serial);
  if (!revoked || !*revoked) return false;  // an unreadable list is logged, and lets nobody in
  const std::string reason =
      text("the certificate of {} (serial {}) was revoked: ask for a new one", who.name, who.serial);
  if (settings_.on_revoked) settings_.on_revoked(who, session.peer());
  if (session_of(session.worker()) == &session) {
    expel(session.worker(), reason, Parting::kCut);
  } else {
    ++refused_;
    note(0, text("{} is cut off: {}", session.name(), reason));
    session.cut(reason);
  }
  return true;
}

// Those that say nothing and are told nothing are cut off too.
void Server::cut_off_revoked() {
  if (!settings_.tls) return;
  const size_t now = settings_.tls->revocations().serials;
  if (std::exchange(revocations_, now) == now) return;
  std::vector<Session*> all;
  for (const auto& session : sessions_) all.push_back(session.get());
  for (Session* session : all) cut_off(*session);
}

}  // namespace kiln
