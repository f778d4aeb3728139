#include "coordinator/service/verbs.h"

#include "common/base/format.h"

namespace kiln {

std::span<const Verb> verb_table() {
  // ROOM: a verb has its line here and its function in one of verbs_*.cpp.
  static constexpr Verb kVerbs[] = {
      {"submit", Access::kSubmit, verb_submit},
      {"upload", Access::kSubmit, verb_upload},
      {"uploaded", Access::kSubmit, verb_uploaded},
      {"jobs", Access::kRead, verb_jobs},
      {"job", Access::kRead, verb_job},
      {"fetch", Access::kRead, verb_fetch},
      {"cancel", Access::kSubmit, verb_cancel},
      {"pause", Access::kSubmit, verb_pause},
      {"resume", Access::kSubmit, verb_resume},
      {"priority", Access::kSubmit, verb_priority},
      {"retry", Access::kSubmit, verb_retry},
      {"forget", Access::kSubmit, verb_forget},
      {"why", Access::kRead, verb_why},
      {"workers", Access::kRead, verb_workers},
      {"forgive", Access::kAdmin, verb_forgive},
      {"status", Access::kRead, verb_status},
      {"events", Access::kRead, verb_events},
      {"enrol", Access::kEnrol, verb_enrol},
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
    return reply;
  }
  return fail(ErrorKind::kUsage, text("this coordinator has no verb '{}'", name.substr(0, 64)));
}

}  // namespace kiln
