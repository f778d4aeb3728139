// A worker program whose bake is a pure function of (site, sample) and which can be told to misbehave by
// KILN_STUB: "key=value;...". UNIT is a unit's id, "all", or "%N": those whose id is a multiple of N.
//   slow=MS      each unit takes so long        factor=F     and F times that
//   crash=UNIT   dies by SIGSEGV in the unit    hang=UNIT    never ends the unit
//   fail=UNIT    fails the unit (no memory)     invalid=UNIT fails it as invalid input
//   nan=UNIT     answers NaN                    shape=UNIT   answers one site too few
//   wrong=UNIT   right form, wrong radiance     zeros=UNIT   right form, all zero
//   someone=UNIT answers in the name of the unit after it
//   other=UNIT   answers other numbers the second time this machine is asked (needs dir=)
//   class=NAME   numeric class                  first_class=NAME  class of one process only (needs dir=)
//   refuse=1     cannot make the scene          no_class=ISA cannot run kernels ISA
//   dir=DIR      folder for marks               first_only=1 all but one process behave (needs dir=)
// and on the wire (fault_proxy.h; coordinator on loopback, without TLS):
//   copies=N     sends each result N times      flip=N       flips a bit of every N-th frame
//   version=N    states another version         deaf=withdraw, deaf=ack  never hears such messages
#include <fcntl.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdlib>
#include <limits>
#include <map>
#include <thread>

#include "common/responses/quantities.h"
#include "common/wire/listener.h"
#include "tests/farm/fault_proxy.h"
#include "tests/farm/stub_bake.h"
#include "worker/agent/program.h"

namespace kiln::test {
namespace {

using Options = std::map<std::string, std::string>;

bool first(const Options& o, const std::string& what);

Options read_options() {
  Options found;
  const char* text = std::getenv("KILN_STUB");
  std::string rest = text ? text : "";
  while (!rest.empty()) {
    const size_t end = rest.find(';');
    const std::string entry = rest.substr(0, end);
    found[entry.substr(0, entry.find('='))] = entry.substr(entry.find('=') + 1);
    rest = end == std::string::npos ? "" : rest.substr(end + 1);
  }
  if (found.count("first_only") && !first(found, "culprit")) return {};
  return found;
}

const Options& options() {
  static const Options read = read_options();
  return read;
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
      : options_(options()), planes_(static_cast<uint32_t>(MomentLayout(basis).planes())) {}

  Expected<UnitResult> bake(const WorkUnit& unit, const IrradianceCache* cache) const override {
    if (options_.count("dir"))
      first(options_, "unit-" + std::to_string(unit.id) + "-" + std::to_string(::getpid()));
    if (options_.count("slow")) {
      const double factor = options_.count("factor") ? std::stod(options_.at("factor")) : 1.0;
      std::this_thread::sleep_for(
          std::chrono::duration<double, std::milli>(std::stoi(options_.at("slow")) * factor));
    }
    if (is("crash", unit)) ::raise(SIGSEGV);
    while (is("hang", unit)) ::pause();
    if (is("fail", unit)) return fail(ErrorKind::kNoSpace, "not enough memory, says the stub");
    if (is("invalid", unit)) return fail(ErrorKind::kInvalidInput, "site does not exist, says the stub");
    UnitResult result = stub_bake(unit, planes_, cache);
    if (is("nan", unit)) result.moments.back() = std::numeric_limits<double>::quiet_NaN();
    if (is("wrong", unit))
      for (double& m : result.moments) m = 1.25 * m + 0.5;
    if (is("zeros", unit)) result.moments.assign(result.moments.size(), 0.0);
    if (is("someone", unit)) ++result.unit;
    if (is("other", unit) && !first(options_, "answered")) result.moments.front() += 1;
    if (is("shape", unit)) {
      --result.site_count;
      result.moments.resize(result.moments.size() - planes_);
    }
    return result;
  }
  size_t sites() const override { return kStubSites; }
  std::vector<std::string> warnings() const override { return {}; }

 private:
  bool is(const char* key, const WorkUnit& unit) const {
    const auto it = options_.find(key);
    if (it == options_.end() || it->second.empty()) return false;
    if (it->second[0] == '%') return unit.id % std::stoull(it->second.substr(1)) == 0;
    return it->second == "all" || it->second == std::to_string(unit.id);
  }
  Options options_;
  uint32_t planes_;
};

Expected<std::string> stub_class(const std::string& isa) {
  const Options& o = options();
  if (o.count("no_class") && o.at("no_class") == isa)
    return fail(ErrorKind::kInternal, "this processor does not run " + isa + ", says the stub");
  if (o.count("first_class") && first(o, "class")) return o.at("first_class");
  return o.count("class") ? o.at("class") : isa + "-stub";
}

Expected<std::unique_ptr<Baker>> make_stub(Scene, Atlas, const TransportSettings& settings, unsigned) {
  if (options().count("refuse")) return fail(ErrorKind::kInternal, "the stub has no accelerator");
  return std::unique_ptr<Baker>(std::make_unique<StubBaker>(settings.basis));
}

// The agent then speaks through the proxy.
void start_faults() {
  const auto value = [](const char* key) {
    const auto it = options().find(key);
    return it == options().end() ? 0u : static_cast<uint32_t>(std::stoul(it->second));
  };
  const auto deaf = options().find("deaf");
  WireFaults faults{std::max(1u, value("copies")), value("flip"), value("version"),
                    deaf != options().end() && deaf->second == "withdraw",
                    deaf != options().end() && deaf->second == "ack"};
  const char* connect = std::getenv("KILN_CONNECT");
  const bool any = faults.copies > 1 || faults.flip_every || faults.version || deaf != options().end();
  if (!any || !connect) return;
  const auto address = parse_address(connect);
  if (!address) return;
  const std::string through = "127.0.0.1:" + std::to_string(start_fault_proxy(address->second, faults));
  ::setenv("KILN_CONNECT", through.c_str(), 1);
}

}  // namespace
}  // namespace kiln::test

int main(int argc, char** argv) {
  kiln::test::start_faults();
  std::_Exit(
      kiln::worker_main({argv + 1, argv + argc}, "stub", kiln::test::make_stub, kiln::test::stub_class));
}
