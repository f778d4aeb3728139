#include <charconv>
#include <cstdio>
#include <filesystem>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/cli/command.h"
#include "coordinator/measure/compare/difference_picture.h"
#include "coordinator/measure/compare/places.h"
#include "coordinator/measure/compare/summary.h"
#include "coordinator/scene/imageio/imageio.h"

namespace kiln {
namespace {

// Parses a number of the command line above 0 and below `limit`.
Status store_option(const Arguments& a, const char* name, double limit, double& value) {
  if (!a.has(name)) return {};
  const std::string given = a.get(name);
  const auto [end, code] = std::from_chars(given.data(), given.data() + given.size(), value);
  if (code == std::errc() && end == given.data() + given.size() && value > 0 && value < limit) return {};
  return fail(ErrorKind::kUsage,
              text("--{} {}: a number above 0 and below {:g} is wanted", name, given, limit));
}

Status compare(const Arguments& arguments) {
  CompareSettings settings;
  double worst = static_cast<double>(settings.worst);
  KILN_TRY_STATUS(store_option(arguments, "error", 1e6, settings.error));
  KILN_TRY_STATUS(store_option(arguments, "confidence", 1, settings.confidence));
  KILN_TRY_STATUS(store_option(arguments, "worst", 1e6, worst));
  settings.worst = static_cast<size_t>(worst);
  KILN_TRY(const ErrorMap a, read_error_map(arguments.get("a")));
  KILN_TRY(const ErrorMap b, read_error_map(arguments.get("b")));
  ErrorMap second;
  if (arguments.has("b2")) {
    KILN_TRY(second, read_error_map(arguments.get("b2")));
  }
  const ErrorMap* const b2 = arguments.has("b2") ? &second : nullptr;
  KILN_TRY(Comparison c, compare_maps(a, b, b2, settings));
  name_places(arguments.get("a"), c.worst);
  if (arguments.has("picture")) {
    const Picture p = difference_picture(a, relative_differences(a, b, b2));
    KILN_TRY_STATUS(write_png(arguments.get("picture"), p.width, p.height, p.rgb));
  }
  if (arguments.has("csv")) KILN_TRY_STATUS(write_file_atomic(arguments.get("csv"), comparison_csv(c)));
  std::fputs((arguments.has("json") ? comparison_json(c, settings) : comparison_text(c, settings)).c_str(),
             stdout);
  return {};
}

int run(const Arguments& arguments, const BakeSettings&) {
  const Status s = compare(arguments);
  return s ? 0 : report_error(s.error());
}

}  // namespace

Command compare_command() {
  return {
      "compare",
      "Compare a bake with a reference of the same layout: bias, RMSE, relMSE, percentiles, worst texels, "
      "and the accuracy of its reported error",
      "kiln compare out reference\n"
      "  kiln compare out reference-seed-1 reference-seed-2 --picture error.png   # noise of the reference "
      "drops out",
      {{"a", "A", "output folder or EXR", true},
       {"b", "B", "the reference", true},
       {"b2", "B2",
        "a second reference, independent of the first (another --seed): the two are halves of one"},
       {"--error", "E", "relative error that the bake aimed for, as its --error [0.05]"},
       {"--confidence", "C", "confidence of the reported errors, as the bake's --confidence [0.95]"},
       {"--worst", "N", "texels to list [5]"},
       {"--picture", "FILE.png", "map of the signed relative error"},
       {"--csv", "FILE", "the figures as one line of CSV with a header"},
       {"--json", "", "print JSON"}},
      false,
      run};
}

}  // namespace kiln
