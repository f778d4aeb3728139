#include "coordinator/output/probes/published.h"

#include <nlohmann/json.hpp>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/probes/volume.h"

namespace kiln {
namespace {

using Json = nlohmann::json;  // files of many bricks have more values than parse_json() reads

DVec3 vector_of(const Json& value) {
  return DVec3(value.at(0).get<double>(), value.at(1).get<double>(), value.at(2).get<double>());
}

PublishedProbeVolume volume_of(const Json& value) {
  PublishedProbeVolume v;
  v.name = value.at("name").get<std::string>();
  if (value.contains("node")) v.node = value.at("node").get<uint32_t>();
  v.low = vector_of(value.at("min"));
  v.high = vector_of(value.at("max"));
  v.spacing = value.at("spacing").get<double>();
  v.levels = value.at("levels").get<uint32_t>();
  v.visibility = value.at("visibility").get<bool>();
  if (value.contains("bevy")) {
    const Json& bevy = value.at("bevy");
    v.bevy = {bevy.at("file").get<std::string>(), vector_of(bevy.at("translation")),
              vector_of(bevy.at("scale"))};
  }
  return v;
}

}  // namespace

Expected<PublishedProbes> read_published_probes(const std::filesystem::path& folder) {
  const std::filesystem::path path = folder / "probes.json";
  KILN_TRY(const Bytes bytes, read_file(path));
  try {
    const char* const begin = reinterpret_cast<const char*>(bytes.data());
    const Json document = Json::parse(begin, begin + bytes.size());
    PublishedProbes out{document.at("probes").get<uint64_t>(), {}};
    for (const Json& value : document.at("volumes")) {
      out.volumes.push_back(volume_of(value));
      const uint32_t levels = out.volumes.back().levels;
      if (levels < 1 || levels > kMaxProbeLevels)
        return fail(ErrorKind::kInvalidInput, text("{}: a volume has {} levels", path.string(), levels));
    }
    return out;
  } catch (const Json::exception& e) {
    return fail(ErrorKind::kInvalidInput, text("{}: {}", path.string(), e.what()));
  }
}

}  // namespace kiln
