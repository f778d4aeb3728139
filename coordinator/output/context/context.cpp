#include "coordinator/output/context/context.h"

#include "common/base/format.h"
#include "common/base/release.h"
#include "common/responses/basis.h"

namespace kiln {

std::string program_name() {
  return "Kiln " + release_number();
}

std::string fit_name(const BakeSettings& settings) {
  const BasisInfo& basis = basis_of(settings);
  if (basis.fit.empty()) return "none";
  return text("{}{}", basis.fit, basis.evaluator == "linear" ? "" : text(" for {}", basis.evaluator));
}

LampChoice choose_lamps(const OutputContext& c) {
  LampChoice choice{c.settings.lamps, {}, false};
  if (!has_direct_light(c.settings)) return {"keep", {}, false};
  if (c.display)
    for (const DisplayLamp& lamp : c.display->lamps)
      if (lamp.direct) choice.in_map.push_back(&lamp);
  for (const Record& light : c.scene.lights)
    if (const Property* bake = light.find("bake"); light.type == "environment" && bake)
      choice.sky |= bake->word == "full";
  return choice;
}

std::string page_name(const std::string& stem, const std::string& extension, uint32_t page, uint32_t pages) {
  return pages == 1 ? text("{}.{}", stem, extension) : text("{}.{}.{}", stem, page, extension);
}

}  // namespace kiln
