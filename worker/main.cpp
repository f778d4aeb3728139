// kiln-worker: the agent with Embree behind it.
#include <cstdlib>

#include "worker/agent/program.h"
#include "worker/bake/baker.h"

int main(int argc, char** argv) {
  const int status = kiln::worker_main({argv + 1, argv + argc}, KILN_ENGINE, kiln::Baker::create,
                                       kiln::numeric_class, kiln::Baker::create_for_probes);
  std::_Exit(status);  // do not wait for a unit that still runs
}
