// What a comparison reads of a bake: light, stated error and where it was measured.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/status.h"

namespace kiln {

// Luminance of E by texel; pages are stacked, row 0 on top.
struct ErrorMap {
  std::string name;  // for messages
  uint32_t width = 0, page_height = 0, pages = 1;
  std::vector<double> light;
  std::vector<bool> measured;  // by sampling: what was filled or dilated says nothing of the sampling
  std::vector<double> stated;  // standard error of the luminance; empty: not stated
  // From 1, where charts.json lies beside the bake: the chart that the texel is of; 0: none, or not measured.
  std::vector<uint32_t> chart;
};

// An output folder of a bake (irradiance.exr, and error.exr and validity.exr where they are), or one EXR file
// with channels R G B or a single one, where A = 0 marks texels that are not held. Texels that count must be
// finite. Errors name the file, what is wrong with it and what is wanted.
Expected<ErrorMap> read_error_map(const std::filesystem::path& folder_or_exr);

}  // namespace kiln
