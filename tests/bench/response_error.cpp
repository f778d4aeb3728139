// Do responses report true errors? Compares ao, sky and bent of a bake with a reference of the same layout:
//
//     response_error OUT REFERENCE
//
// Prints a row for docs/responses.md for each response that both hold: texels measured in both, root mean
// square difference, that divided by the reported one (both bakes' errors added in squares), and the share of
// texels within 1.96 reported errors (in which a vector counts by its length).
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <string>

#include "common/responses/response.h"
#include "coordinator/scene/imageio/exr.h"

namespace kiln {
namespace {

constexpr double kInterval = 1.96;  // of a normal distribution at 95 %
constexpr float kMeasured = 1.0f;   // in validity.exr

Expected<bool> print_row(const std::filesystem::path& out, const std::filesystem::path& reference,
                         const std::string& name) {
  const std::string master = name + ".exr", error = "error_" + master;
  if (!std::filesystem::exists(out / master) || !std::filesystem::exists(reference / master)) return false;
  KILN_TRY(const Planes validity, read_exr(out / "validity.exr"));
  KILN_TRY(const Planes a, read_exr(out / master));
  KILN_TRY(const Planes a_error, read_exr(out / error));
  KILN_TRY(const Planes b, read_exr(reference / master));
  KILN_TRY(const Planes b_error, read_exr(reference / error));
  for (const Planes* p : {&a, &a_error, &b, &b_error})
    if (p->data.front().size() != validity.data.front().size())
      return fail(ErrorKind::kInvalidInput, "the layouts differ: bake both with the same --texels-per-metre");
  double texels = 0, within = 0, squares = 0, reported = 0;
  for (size_t t = 0; t < validity.data[0].size(); ++t) {
    if (validity.data[0][t] != kMeasured) continue;
    double square = 0;
    for (size_t c = 0; c < a.data.size(); ++c) square += std::pow(double{a.data[c][t]} - b.data[c][t], 2);
    const double variance = std::pow(a_error.data[0][t], 2) + std::pow(b_error.data[0][t], 2);
    within += square <= kInterval * kInterval * variance;
    squares += square;
    reported += variance;
    ++texels;
  }
  std::printf("| %s | %s | %.0f | %.4f | %.2f | %.1f %% |\n", out.filename().c_str(), name.c_str(), texels,
              std::sqrt(squares / texels), std::sqrt(squares / reported), 100 * within / texels);
  return true;
}

int run(int argc, char** argv) {
  if (argc != 3) {
    std::fputs("usage: response_error OUT REFERENCE\n", stderr);
    return 2;
  }
  bool any = false;
  for (const ResponseInfo& response : response_roster()) {
    const Expected<bool> printed = print_row(argv[1], argv[2], std::string(response.name));
    if (!printed) {
      std::fprintf(stderr, "%s\n", printed.error().message.c_str());
      return 2;
    }
    any |= *printed;
  }
  if (!any) std::fputs("neither folder holds the master of a response\n", stderr);
  return any ? 0 : 2;
}

}  // namespace
}  // namespace kiln

int main(int argc, char** argv) {
  return kiln::run(argc, argv);
}
