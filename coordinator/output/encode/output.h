// ROOM: add an output. One pair of files and one line in the roster.
#pragma once

#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "common/base/hash.h"
#include "coordinator/output/context/context.h"
#include "coordinator/output/gltf/gltf.h"

namespace kiln {

struct OutputFile {
  std::string name;
  uint64_t bytes = 0;
  Digest digest;
  bool master = false;  // its digest must be equal for equal inputs, seed and numeric class
};

struct Output {
  std::string_view name;
  std::string_view about;
  bool master;
  // Writes its files into the folder and returns their names.
  Expected<std::vector<std::string>> (*write)(const OutputContext&);
};

std::span<const Output> output_roster();

// Writes every output of the roster; digests are those of the files.
Expected<std::vector<OutputFile>> write_outputs(const OutputContext& context);

Expected<std::vector<std::string>> write_irradiance(const OutputContext& context);
Expected<std::vector<std::string>> write_split(const OutputContext& context);
Expected<std::vector<std::string>> write_basis(const OutputContext& context);
Expected<std::vector<std::string>> write_error(const OutputContext& context);
Expected<std::vector<std::string>> write_band_error(const OutputContext& context);
Expected<std::vector<std::string>> write_measured(const OutputContext& context);
Expected<std::vector<std::string>> write_responses(const OutputContext& context);
Expected<std::vector<std::string>> write_samples(const OutputContext& context);
Expected<std::vector<std::string>> write_validity(const OutputContext& context);
Expected<std::vector<std::string>> list_textures(const OutputContext& context);
Expected<std::vector<std::string>> write_charts(const OutputContext& context);

}  // namespace kiln
