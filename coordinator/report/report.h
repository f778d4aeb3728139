// Everything asked, decided and measured in a bake, for people (HTML, pictures) and machines (JSON).
#pragma once

#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "common/atlas/atlas.h"
#include "common/base/figures.h"
#include "common/job/settings.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/bake/plan/plan.h"
#include "coordinator/farm/dispatch/farm.h"
#include "coordinator/output/encode/output.h"
#include "coordinator/output/textures/textures.h"
#include "coordinator/report/report_pictures.h"
#include "coordinator/scene/display/display.h"
#include "coordinator/scene/import/import.h"

namespace kiln {

// State after a pass: one point of the curve of error against run time.
struct PassPoint {
  double samples = 0;        // mean per texel
  bool kept = true;          // false: its samples only made an irradiance cache and were dropped
  uint64_t active = 0;       // texels sampled in this pass
  double seconds = 0;        // since the first unit was handed out
  uint64_t rays = 0;         // rays so far
  double seconds_left = -1;  // predicted time to the end of the bake; negative: unknown
  // Root mean square and maximum of reported error / E over measured texels with E > 0; E is
  // clamped to a hundredth of the map's mean.
  double rms_relative = 0;
  double worst_relative = 0;
  double converged_share = 0;  // share of the measured, lit texels
};

// A sample with radiance beyond float range, which was dropped: the first one in its unit.
struct NonfinitePlace {
  uint32_t x = 0, y = 0, page = 0;  // the texel
  std::string instance;
  uint32_t site = 0, sample = 0;  // to replay it: a unit of this one site and sample
};

// The map as a whole. Relative errors are reported standard errors over E, with E clamped to a
// hundredth of the map's mean. Unlit texels are in no share: their error is unknown.
struct MapStatement {
  uint64_t texels = 0;         // with a surface, not inside geometry
  uint64_t never_sampled = 0;  // filled from neighbours
  uint64_t few_samples = 0;    // lit by few bright samples: their error is unreliable
  uint64_t met_no_light = 0;
  double median_relative = 0, p95_relative = 0;
  double within_target = 0;  // share within the asked-for error at the asked-for confidence
};

// One response of the map. Errors are standard errors as shares of full visibility.
struct ResponseStatement {
  std::string name;
  double median_error = 0, p95_error = 0;
  double within_target = 0;  // share within --visibility-error at the asked-for confidence
};

// The first pass of --two-pass, made before the map's layout.
struct TwoPassFigures {
  uint32_t samples = 0;  // per texel in the first pass; 0: no first pass
  uint64_t rays = 0;
  double worker_seconds = 0;
  uint64_t black_lit = 0;  // charts that the first pass found black but the map found lit
  // Collapsed placements by reason, as list_charts gives them; with them the layout can be rebuilt.
  std::string collapsed[kCollapseReasons];
};

// The probes of a bake; relative errors are of E, root mean square over all normals.
struct ProbeFigures {
  uint64_t volumes = 0, probes = 0, inactive = 0, moved = 0;
  uint64_t skipped = 0;  // their units failed on every worker
  bool complete = true;  // false: stopped by the time limit
  double samples = 0;    // mean of the active ones
  double median_relative = 0, p95_relative = 0;
  uint64_t rays = 0;
  double seconds = 0, worker_seconds = 0;
};

// What became of the file's lamps in scene.glb.
struct LampReport {
  std::string mode;                 // "drop", "keep", "mark": what was done
  std::vector<std::string> in_map;  // names of lamps whose direct light is in the map
  bool sky_in_map = false;          // the direct light of an environment is
  uint64_t others = 0;              // lamps that scene.glb has in any mode
};

struct BakeReport {
  std::filesystem::path scene_path;
  BakeSettings settings;
  std::vector<ImportNote> notes;
  std::vector<std::string> warnings;
  Plan plan;
  std::string layout;
  uint32_t width = 0, height = 0, pages = 0;
  uint64_t charts = 0, owned_texels = 0;
  std::string scene_id;
  AtlasStatistics atlas;
  uint64_t unseen_lit = 0;  // charts that --unseen auto collapsed but the map found lit
  TwoPassFigures two_pass;
  std::string kept_layout;  // SHA-256 of the --keep-layout file; empty: none
  std::vector<StageTime> stages;
  std::vector<PassPoint> passes;
  FarmStatistics farm;
  std::vector<NonfinitePlace> nonfinite;
  std::vector<DisplayFit> lods;
  Figures post;
  MapStatement statement;  // for light
  std::vector<ResponseStatement> responses;
  uint64_t texels_by_class[kValidityClasses] = {};
  bool complete = true;  // false: time ran out before the error, or the last sample allowed, was reached
  // Share of the texels that have --max-samples and would need more for what is asked.
  double held_back = 0;
  double total_seconds = 0;
  std::vector<TextureFigures> textures;
  std::string
      unmet;  // why the bake failed although its masters are complete, in a sentence; empty: it succeeded
  std::vector<OutputFile> outputs;
  LampReport lamps;
  ProbeFigures probes;          // no volumes: none were asked for
  std::set<std::string> files;  // all that the bake wrote but report.json: the next bake replaces them
};

// What ended the passes: "error", all that was asked is reached; "max-samples"; "time-limit".
std::string_view stopped_by(const BakeReport& report);
// What a user can do for a better map, in a sentence; empty if the map is what was asked for.
std::string next_step(const BakeReport& report);

std::string_view validity_name(Validity v);

// "median error 2.1 %, 95th percentile 8.3 %, 87.5 % of texels within 5 %; 120 texels never sampled".
std::string statement_text(const BakeReport& report);

// Text of report.json.
std::string report_json(const BakeReport& report);
// One self-contained page with embedded pictures; empty ones are left out.
Expected<std::string> report_html(const BakeReport& report, const Lightmap& map,
                                  const ReportPictures& pictures,
                                  std::span<const std::vector<float>> texture_errors = {});

}  // namespace kiln
