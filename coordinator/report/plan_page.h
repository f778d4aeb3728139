// The results of `kiln plan`, as JSON and as a page.
#pragma once

#include <filesystem>
#include <string>

#include "coordinator/bake/plan/plan.h"
#include "coordinator/picture/picture.h"
#include "coordinator/scene/display/display.h"
#include "coordinator/scene/import/import.h"

namespace kiln {

struct PlanView {
  const ImportResult& imported;
  const Atlas& atlas;
  const Plan& plan;
  const Projection& projection;  // projection of levels and display meshes
};

// Text of plan.json: layout, numbers, "objects" by instance, findings.
std::string plan_json(const PlanView& view);
// Those of width 0 are not there.
struct PlanPictures {
  Picture heat_map, probes;
};
// One self-contained page; the pictures are embedded.
Expected<std::string> plan_html(const PlanView& view, const std::filesystem::path& scene,
                                const PlanPictures& pictures);
// The rows of "objects" in plan.json and report.json.
void write_objects(class JsonWriter& writer, const std::vector<ObjectPlan>& objects);

// "unseen" of plan.json, and of "atlas" in report.json: the charts that --unseen auto collapsed.
class JsonWriter& write_unseen(class JsonWriter& writer, const AtlasStatistics& atlas);

std::string_view note_kind(ImportNote::Kind kind);  // for example "warning"

}  // namespace kiln
