// The maps that a comparison reads: light, reported error and which texels were measured.
#pragma once

#include <cstdint>
#include <filesystem>
#include <string>
#include <vector>

#include "common/base/status.h"

namespace kiln {

// Luminance of E by texel; pages are stacked, row 0 at the top.
struct ErrorMap {
  std::string name;  // for messages
  uint32_t width = 0, page_height = 0, pages = 1;
  std::vector<double> light;
  std::vector<bool> measured;  // by sampling; filled or dilated texels say nothing about sampling
  std::vector<double> stated;  // standard error of the luminance; empty if not reported
  // With charts.json beside the bake: the texel's chart, from 1; 0: none, or not measured.
  std::vector<uint32_t> chart;
};

// Reads an output folder of a bake (irradiance.exr, and error.exr and validity.exr if present), or one EXR
// file with channels R G B or a single one, where A = 0 marks texels without a value. Texels that count must
// be finite. Errors name the file, what is wrong with it and what is expected.
Expected<ErrorMap> read_error_map(const std::filesystem::path& folder_or_exr);

}  // namespace kiln
