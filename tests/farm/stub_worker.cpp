// A worker program whose bake is a pure function of (site, sample) and which can be told to misbehave by
// KILN_STUB: "key=value;..." with
//   slow=MS      each unit takes so long        crash=UNIT   dies by SIGSEGV when it begins the unit
//   nan=UNIT     answers NaN                    shape=UNIT   answers one site too few
//   fail=UNIT    fails the unit (no memory)     invalid=UNIT fails it as invalid input
//   other=UNIT   answers other numbers the second time this machine is asked (needs dir=)
//   class=NAME   numeric class                  first_class=NAME;dir=DIR  class of one process only
//   refuse=1     cannot make the scene          dir=DIR      folder for marks
#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <chrono>
#include <cstdlib>
#include <limits>
#include <map>
#include <thread>

#include "common/basis/basis.h"
#include "tests/farm/stub_bake.h"
#include "worker/agent/options.h"

namespace kiln::test {
namespace {

using Options = std::map<std::string, std::string>;

Options options() {
  Options found;
  const char* text = std::getenv("KILN_STUB");
  std::string rest = text ? text : "";
  while (!rest.empty()) {
    const size_t end = rest.find(';');
    const std::string entry = rest.substr(0, end);
    found[entry.substr(0, entry.find('='))] = entry.substr(entry.find('=') + 1);
    rest = end == std::string::npos ? "" : rest.substr(end + 1);
  }
  return found;
}

// True for the first caller on this machine.
bool first(const Options& o, const std::string& what) {
  const int fd = ::open((o.at("dir") + "/" + what).c_str(), O_CREAT | O_EXCL | O_WRONLY, 0644);
  if (fd >= 0) ::close(fd);
  return fd >= 0;
}

class StubBaker final : public Baker {
 public:
  explicit StubBaker(uint32_t basis)
      : options_(options()), planes_(static_cast<uint32_t>(moment_plane_names(basis).size())) {}

  Expected<UnitResult> bake(const WorkUnit& unit) const override {
    if (options_.count("dir"))
      first(options_, "unit-" + std::to_string(unit.id) + "-" + std::to_string(::getpid()));
    if (options_.count("slow"))
      std::this_thread::sleep_for(std::chrono::milliseconds(std::stoi(options_.at("slow"))));
    if (is("crash", unit)) ::raise(SIGSEGV);
    if (is("fail", unit)) return fail(ErrorKind::kNoSpace, "not enough memory, says the stub");
    if (is("invalid", unit)) return fail(ErrorKind::kInvalidInput, "site does not exist, says the stub");
    UnitResult result = stub_bake(unit, planes_);
    if (is("nan", unit)) result.moments.back() = std::numeric_limits<double>::quiet_NaN();
    if (is("other", unit) && !first(options_, "answered")) result.moments.front() += 1;
    if (is("shape", unit)) {
      --result.site_count;
      result.moments.resize(result.moments.size() - planes_);
    }
    return result;
  }
  std::vector<std::string> warnings() const override { return {}; }

 private:
  bool is(const char* key, const WorkUnit& unit) const {
    const auto it = options_.find(key);
    return it != options_.end() && it->second == std::to_string(unit.id);
  }
  Options options_;
  uint32_t planes_;
};

Expected<std::string> stub_class(const std::string& isa) {
  const Options o = options();
  if (o.count("first_class") && first(o, "class")) return o.at("first_class");
  return o.count("class") ? o.at("class") : isa + "-stub";
}

Expected<std::unique_ptr<Baker>> make_stub(Scene, Atlas, const TransportSettings& settings, unsigned) {
  if (options().count("refuse")) return fail(ErrorKind::kInternal, "the stub has no accelerator");
  return std::unique_ptr<Baker>(std::make_unique<StubBaker>(settings.basis));
}

}  // namespace
}  // namespace kiln::test

int main(int argc, char** argv) {
  std::_Exit(
      kiln::worker_main({argv + 1, argv + argc}, "stub", kiln::test::make_stub, kiln::test::stub_class));
}
