#include "worker/lights/lights.h"

#include "common/base/format.h"

namespace kiln {

Expected<Lights> Lights::create(const Surfaces& surfaces, std::vector<std::string>& warnings,
                                LightChoice choice) {
  Lights lights;
  const Record* environment = nullptr;
  for (const Record& record : surfaces.scene().lights) {
    RecordReader r(record);
    KILN_TRY(const bool local, lights.local.add(r, record, surfaces.scene()));
    if (local) {
      // Parsed lights.
    } else if (record.type == DirectionalLights::kType) {
      lights.directional.add(r, record.to_world);
    } else if (record.type == Environment::kType) {
      if (environment)
        return fail(ErrorKind::kInvalidInput,
                    text("'{}' is a second environment; there can be only one", record.name));
      environment = &record;
      continue;  // reads and reports its own properties
    } else {
      return fail(
          ErrorKind::kInvalidInput,
          text("light '{}' is of type '{}', which this worker does not know", record.name, record.type));
    }
    for (std::string& sentence : r.unread()) warnings.push_back(std::move(sentence));
  }
  KILN_TRY(lights.environment, Environment::create(environment, surfaces.scene(), warnings));
  lights.directional.finish();
  lights.local.finish(surfaces, choice);
  return lights;
}

}  // namespace kiln
