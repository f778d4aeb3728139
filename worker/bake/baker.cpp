#include "worker/bake/baker.h"

#include "worker/bake/path_baker.h"
#include "worker/bake/probe_receivers.h"
#include "worker/bake/receivers.h"

namespace kiln {

Expected<std::unique_ptr<Baker>> Baker::create(Scene scene, Atlas atlas, const TransportSettings& settings,
                                               unsigned threads) {
  if (settings.basis >= basis_roster().size())
    return fail(ErrorKind::kInvalidInput, text("basis {} does not exist in this worker", settings.basis));
  auto baker = std::make_unique<PathBaker<TexelReceivers>>(TexelReceivers(std::move(atlas)), settings);
  KILN_TRY_STATUS(baker->build(std::move(scene), threads));
  return std::unique_ptr<Baker>(std::move(baker));
}

Expected<std::unique_ptr<Baker>> Baker::create_for_probes(Scene scene, ProbePoints probes,
                                                          const TransportSettings& settings,
                                                          unsigned threads) {
  if (const char* fault = settings.fault()) return fail(ErrorKind::kInvalidInput, fault);
  TransportSettings whole = settings;
  whole.primary = PrimaryDensity::kSphere;
  auto baker = std::make_unique<PathBaker<ProbeReceivers>>(ProbeReceivers(std::move(probes)), whole);
  KILN_TRY_STATUS(baker->build(std::move(scene), threads));
  return std::unique_ptr<Baker>(std::move(baker));
}

}  // namespace kiln
