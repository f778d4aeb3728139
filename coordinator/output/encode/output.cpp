#include "coordinator/output/encode/output.h"

#include "common/base/files.h"

namespace kiln {

std::span<const Output> output_roster() {
  static const Output kRoster[] = {
      {"irradiance", "E at the surface normal", true, write_irradiance},
      {"split", "its parts: direct and indirect light", true, write_split},
      {"basis", "planes of the stored basis", true, write_basis},
      {"error", "stated standard error of E (luminance)", true, write_error},
      {"band_error", "stated standard error of the basis, by band (luminance)", true, write_band_error},
      {"measured", "E and the basis before the denoiser, and their error", true, write_measured},
      {"responses", "ambient occlusion, sky visibility, bent normals, and their errors", true,
       write_responses},
      {"samples", "samples of each texel", true, write_samples},
      {"validity", "class of each texel", true, write_validity},
      {"charts", "where every chart is: the table for engines", true, write_charts},
      {"textures", "compressed textures, already written", false, list_textures},
      {"gltf", "the scene with lightmap coordinates", false, write_gltf},
      {"gltf_instanced", "the scene with every mesh once, for the table", false, write_gltf_instanced},
      {"gltf_unlit", "the scene with its light in unlit textures", false, write_gltf_unlit},
  };
  return kRoster;
}

Expected<std::vector<std::string>> list_textures(const OutputContext& context) {
  return context.texture_files ? *context.texture_files : std::vector<std::string>{};
}

Expected<std::vector<OutputFile>> write_outputs(const OutputContext& context) {
  std::vector<OutputFile> files;
  for (const Output& output : output_roster()) {
    KILN_TRY(const std::vector<std::string> names, output.write(context));
    for (const std::string& name : names) {
      KILN_TRY(const Bytes bytes, read_file(context.folder / name));
      files.push_back({name, bytes.size(), sha256(bytes), output.master});
    }
  }
  return files;
}

}  // namespace kiln
