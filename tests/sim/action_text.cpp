#include "tests/sim/action_text.h"

#include "common/base/format.h"

namespace kiln::sim {
namespace {

std::string line(const Assign& a) {
  return text("assign job {} to {}", a.job, a.worker);
}
std::string line(const Release& a) {
  return text("release {} from job {}: {}", a.worker, a.job, a.reason);
}
std::string line(const Grant& a) {
  return text("grant {}/{} to {}, lease {}", a.job, a.unit, a.worker, a.lease);
}
std::string line(const Recall& a) {
  return text("recall {}/{} from {}", a.job, a.unit, a.worker);
}
std::string line(const StoreAnswer& a) {
  return text("store {}/{} {} by {} ({}), shape {}, ticket {}", a.job, a.unit, a.digest.hex(), a.worker,
              a.identity, a.shape, a.ticket);
}
std::string line(const Settle& a) {
  return text("settle {}/{} {} by {}, verified {}", a.job, a.unit, a.digest.hex(), a.identity, a.verified);
}
std::string line(const Deliver& a) {
  return text("deliver {}/{} {}", a.job, a.unit, a.digest.hex());
}
std::string line(const Revoke& a) {
  return text("revoke {}/{} {}", a.job, a.unit, a.digest.hex());
}
std::string line(const Rewind& a) {
  return text("rewind job {}: {}", a.job, a.reason);
}
std::string line(const PinClass& a) {
  return text("pin job {} to class {}", a.job, a.numeric_class);
}
std::string line(const Acknowledge& a) {
  return text("acknowledge {}/{} {} to {}", a.job, a.unit, a.digest.hex(), a.worker);
}
std::string line(const Trust& a) {
  return text("trust {}: {} agreed", a.identity, a.agreed);
}
std::string line(const Quarantine& a) {
  return text("quarantine {}: {}", a.identity, a.reason);
}
std::string line(const Expel& a) {
  return text("expel {}: {}", a.worker, a.reason);
}
std::string line(const SkipUnit& a) {
  return text("skip {}/{}: {}", a.job, a.unit, a.reason);
}
std::string line(const FailJob& a) {
  return text("fail job {}: {} {}", a.job, static_cast<int>(a.error.kind), a.error.message);
}
std::string line(const PassComplete& a) {
  return text("pass of job {} complete", a.job);
}
std::string line(const Note& a) {
  return text("note on job {}: {}", a.job, a.text);
}

}  // namespace

std::string action_text(const Action& action) {
  return std::visit([](const auto& a) { return line(a); }, action);
}

}  // namespace kiln::sim
