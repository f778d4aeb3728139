#include "worker/bake/baker.h"

#include "worker/bake/path_baker.h"
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

}  // namespace kiln
