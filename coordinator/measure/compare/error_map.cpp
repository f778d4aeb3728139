#include "coordinator/measure/compare/error_map.h"

#include <algorithm>
#include <cmath>

#include "common/base/format.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/measure/compare/ssim.h"
#include "coordinator/output/context/context.h"
#include "coordinator/scene/imageio/exr.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr uint32_t kMaxPages = 64;  // the packer's limit

tl::unexpected<Error> refuse(std::string why) {
  return fail(ErrorKind::kInvalidInput, std::move(why));
}

bool has(const Planes& p, const std::string& name) {
  return std::find(p.names.begin(), p.names.end(), name) != p.names.end();
}

std::string listed(const Planes& p) {
  std::string all;
  for (const std::string& name : p.names) all += (all.empty() ? "" : " ") + name;
  return all.empty() ? "no channel" : all;
}

// The files of a master: one, or one per page.
std::vector<fs::path> pages_of(const fs::path& folder, const std::string& stem) {
  std::error_code code;
  const fs::path single = folder / page_name(stem, "exr", 0, 1);
  if (fs::exists(single, code)) return {single};
  std::vector<fs::path> out;
  while (out.size() < kMaxPages) {
    fs::path page = folder / page_name(stem, "exr", static_cast<uint32_t>(out.size()), 2);
    if (!fs::exists(page, code)) break;
    out.push_back(std::move(page));
  }
  return out;
}

Expected<std::vector<double>> luminances(const Planes& p, const fs::path& path) {
  const bool rgb = has(p, "R") && has(p, "G") && has(p, "B");
  if (!rgb && p.names.size() != 1)
    return refuse(
        text("{} has {}: a map of light has R, G and B, or one channel; give irradiance.exr of a bake",
             path.string(), listed(p)));
  std::vector<double> out(size_t{p.width} * p.height);
  for (size_t i = 0; i < out.size(); ++i)
    out[i] = rgb ? 0.2126 * p.plane("R")[i] + 0.7152 * p.plane("G")[i] + 0.0722 * p.plane("B")[i]
                 : double{p.data[0][i]};
  return out;
}

Status add_page(const fs::path& path, ErrorMap& map) {
  KILN_TRY(const Planes p, read_exr(path));
  KILN_TRY(const std::vector<double> light, luminances(p, path));
  if (map.light.empty()) {
    map.width = p.width;
    map.page_height = p.height;
  }
  if (p.width != map.width || p.height != map.page_height)
    return refuse(text("{} has {}x{} texels, other pages of the bake {}x{}", path.string(), p.width, p.height,
                       map.width, map.page_height));
  map.light.insert(map.light.end(), light.begin(), light.end());
  for (size_t i = 0; i < light.size(); ++i) map.measured.push_back(!has(p, "A") || p.plane("A")[i] > 0.5f);
  return {};
}

// The single channel of error.exr or validity.exr; nothing if the folder has no such file.
Expected<std::vector<double>> read_plane(const fs::path& folder, const std::string& stem,
                                         const ErrorMap& map) {
  std::vector<double> out;
  const std::vector<fs::path> files = pages_of(folder, stem);
  for (const fs::path& path : files) {
    KILN_TRY(const Planes p, read_exr(path));
    if (p.names.size() != 1)
      return refuse(text("{} has {}: one channel is expected", path.string(), listed(p)));
    if (p.width != map.width || p.height != map.page_height)
      return refuse(text("{} has {}x{} texels, irradiance.exr beside it {}x{}: they are of two bakes",
                         path.string(), p.width, p.height, map.width, map.page_height));
    out.insert(out.end(), p.data[0].begin(), p.data[0].end());
  }
  if (!files.empty() && files.size() != map.pages)
    return refuse(text("{}: {} pages of {}, {} of irradiance: they are of two bakes", folder.string(),
                       files.size(), stem, map.pages));
  return out;
}

std::string place_of(const ErrorMap& map, size_t i) {
  const size_t row = i / map.width;
  return text("texel ({}, {}){}", i % map.width, row % map.page_height,
              map.pages > 1 ? text(" of page {}", row / map.page_height) : "");
}

Status check_values(const ErrorMap& map) {
  for (size_t i = 0; i < map.light.size(); ++i) {
    if (!map.measured[i]) continue;
    if (!std::isfinite(map.light[i]))
      return refuse(
          text("{}: {} is {}: a bake writes finite light; the file is damaged or of another program",
               map.name, place_of(map, i), map.light[i]));
    // A texel with a single sample has an infinite error; other non-finite values are damage.
    if (!map.stated.empty() && !(map.stated[i] >= 0))
      return refuse(text("{}: the stated error of {} is {}: error.exr is damaged or of another program",
                         map.name, place_of(map, i), map.stated[i]));
  }
  return {};
}

Status read_folder(const fs::path& folder, ErrorMap& map) {
  const std::vector<fs::path> files = pages_of(folder, "irradiance");
  if (files.empty())
    return refuse(
        text("{} has no irradiance.exr: give the output folder of a bake, or an EXR file", folder.string()));
  map.pages = static_cast<uint32_t>(files.size());
  for (const fs::path& path : files) KILN_TRY_STATUS(add_page(path, map));
  KILN_TRY(map.stated, read_plane(folder, "error", map));
  KILN_TRY(const std::vector<double> validity, read_plane(folder, "validity", map));
  for (size_t i = 0; i < validity.size(); ++i)
    map.measured[i] = validity[i] == static_cast<int>(Validity::kMeasured) ||
                      validity[i] == static_cast<int>(Validity::kPushed);
  return {};
}

}  // namespace

Expected<ErrorMap> read_error_map(const fs::path& folder_or_exr) {
  ErrorMap map;
  map.name = folder_or_exr.string();
  std::error_code code;
  if (fs::is_directory(folder_or_exr, code)) {
    KILN_TRY_STATUS(read_folder(folder_or_exr, map));
  } else {
    KILN_TRY_STATUS(add_page(folder_or_exr, map));
  }
  KILN_TRY_STATUS(check_values(map));
  if (const std::optional<ChartFile> charts = read_chart_boxes(folder_or_exr))
    map.chart = chart_labels(map, charts->boxes);
  return map;
}

}  // namespace kiln
