#include "coordinator/service/verbs.h"

#include "common/base/format.h"
#include "coordinator/service/service_impl.h"

namespace kiln {

std::span<const Verb> verb_table() {
  // ROOM: a verb has its line here and its function in one of verbs_*.cpp.
  static constexpr Verb kVerbs[] = {
      {"submit", Access::kSubmit, true, verb_submit},
      {"upload", Access::kSubmit, false, verb_upload},
      {"uploaded", Access::kSubmit, false, verb_uploaded},
      {"jobs", Access::kRead, false, verb_jobs},
      {"job", Access::kRead, false, verb_job},
      {"fetch", Access::kRead, false, verb_fetch},
      {"cancel", Access::kSubmit, true, verb_cancel},
      {"pause", Access::kSubmit, true, verb_pause},
      {"resume", Access::kSubmit, true, verb_resume},
      {"priority", Access::kSubmit, true, verb_priority},
      {"retry", Access::kSubmit, true, verb_retry},
      {"forget", Access::kSubmit, true, verb_forget},
      {"why", Access::kRead, false, verb_why},
      {"workers", Access::kRead, false, verb_workers},
      {"forgive", Access::kAdmin, true, verb_forgive},
      {"status", Access::kRead, false, verb_status},
      {"events", Access::kRead, false, verb_events},
      {"enrol", Access::kEnrol, true, verb_enrol},
  };
  return kVerbs;
}

Expected<std::string> answer(ServiceImpl& service, const Caller& caller, const std::string& name,
                             const std::string& document, ClientFiles& files) {
  for (const Verb& verb : verb_table()) {
    if (name != verb.name) continue;
    if (caller.access < verb.access)
      return fail(ErrorKind::kUsage,
                  text("'{}' needs the role {}, and {} has {}", name, access_name(verb.access),
                       caller.user.empty() ? "a caller without a certificate" : caller.user,
                       access_name(caller.access)));
    const auto root = parse_json(document);
    if (!root) return fail(ErrorKind::kInvalidInput, text("{}: {}", name, root.error().message));
    auto reply = verb.answer({service, caller, *root, files});
    if (!reply && reply.error().kind == ErrorKind::kInvalidInput)
      return fail(ErrorKind::kInvalidInput, text("{}: {}", name, reply.error().message));
    if (reply && verb.changes) service.audit(caller, name, *root, *reply);
    return reply;
  }
  return fail(ErrorKind::kUsage, text("this coordinator has no verb '{}'", name.substr(0, 64)));
}

}  // namespace kiln
