#include <algorithm>

#include "common/base/format.h"
#include "common/responses/basis.h"
#include "coordinator/output/encode/output.h"
#include "coordinator/scene/imageio/exr.h"

namespace kiln {
namespace {

struct NamedPlane {
  std::string name;
  const std::vector<float>* data;
};

// What the values of a file are, for its header.
struct Meaning {
  std::string quantity, unit;
  bool in_basis = false;  // planes are coefficients of the stored basis
};

constexpr const char* kShare = "1";

ExrNotes notes_of(const OutputContext& c, const Meaning& meaning) {
  return {{"quantity", meaning.quantity},
          {"unit", meaning.unit},
          {"basis", meaning.in_basis ? c.settings.basis : "none"},
          {"fit", meaning.in_basis ? fit_name(c.settings) : "none"}};
}

// One file a page; planes hold all pages stacked.
Expected<std::vector<std::string>> write_pages(const OutputContext& c, const std::string& stem,
                                               const Meaning& meaning,
                                               const std::vector<NamedPlane>& planes) {
  std::vector<std::string> names;
  const size_t page_texels = size_t{c.atlas.width} * c.atlas.height;
  for (uint32_t page = 0; page < c.atlas.pages; ++page) {
    std::vector<ExrChannel> channels;
    for (const NamedPlane& p : planes) channels.push_back({p.name, p.data->data() + page * page_texels});
    names.push_back(page_name(stem, "exr", page, c.atlas.pages));
    KILN_TRY_STATUS(write_exr(c.folder / names.back(), c.atlas.width, c.atlas.height, channels,
                              {ExrType::kFloat, c.compress ? ExrCompression::kZip : ExrCompression::kNone},
                              notes_of(c, meaning)));
  }
  return names;
}

// Alpha of E's files.
std::vector<float> measured_or_filled(const Lightmap& map) {
  std::vector<float> alpha(map.validity.size());
  for (size_t i = 0; i < alpha.size(); ++i) {
    const Validity v = map.validity[i];
    alpha[i] = v == Validity::kMeasured || v == Validity::kPushed || v == Validity::kFilled ? 1.0f : 0.0f;
  }
  return alpha;
}

}  // namespace

Expected<std::vector<std::string>> write_irradiance(const OutputContext& c) {
  if (!c.lightmap.has_light) return std::vector<std::string>{};
  const std::vector<float> alpha = measured_or_filled(c.lightmap);
  const Planes& p = c.lightmap.planes;
  return write_pages(c, "irradiance",
                     {"irradiance E at the surface normal; A: 1 measured or filled", kIrradianceUnit},
                     {{"R", &p.plane("E.R")}, {"G", &p.plane("E.G")}, {"B", &p.plane("E.B")}, {"A", &alpha}});
}

// Filters and seams give both parts the same weights, some of them below 0: of noise they may make a part
// that is negative or more than the whole. Direct light is held between, so that both parts are light and add
// up to E but for the rounding of one float.
Expected<std::vector<std::string>> write_split(const OutputContext& c) {
  std::vector<std::string> files;
  if (!c.lightmap.has_light || !c.settings.split) return files;
  const std::vector<float> alpha = measured_or_filled(c.lightmap);
  std::vector<float> direct[3], indirect[3];
  for (size_t k = 0; k < 3; ++k) {
    const char channel[] = {'.', "RGB"[k], 0};
    const std::vector<float>& all = c.lightmap.planes.plane(std::string("E") + channel);
    direct[k] = c.lightmap.planes.plane(std::string("direct") + channel);
    indirect[k].resize(all.size());
    for (size_t i = 0; i < all.size(); ++i) {
      direct[k][i] = std::clamp(direct[k][i], 0.0f, std::max(0.0f, all[i]));
      indirect[k][i] = all[i] - direct[k][i];
    }
  }
  const auto write = [&](const char* name, const char* about, const std::vector<float>(&part)[3]) -> Status {
    KILN_TRY(const std::vector<std::string> names,
             write_pages(c, name, {about, kIrradianceUnit},
                         {{"R", &part[0]}, {"G", &part[1]}, {"B", &part[2]}, {"A", &alpha}}));
    files.insert(files.end(), names.begin(), names.end());
    return {};
  };
  KILN_TRY_STATUS(write("irradiance.direct", "E straight from emitters; A: 1 measured or filled", direct));
  KILN_TRY_STATUS(
      write("irradiance.indirect", "E reflected at least once; A: 1 measured or filled", indirect));
  return files;
}

Expected<std::vector<std::string>> write_basis(const OutputContext& c) {
  if (!c.lightmap.has_light) return std::vector<std::string>{};
  const BasisInfo& basis = basis_of(c.settings);
  std::vector<NamedPlane> planes;
  for (std::string_view function : basis.functions)
    for (const char* channel : {".R", ".G", ".B"}) {
      const std::string name = std::string(function) + channel;
      planes.push_back({name, &c.lightmap.planes.plane(name)});
    }
  if (planes.empty()) return std::vector<std::string>{};
  return write_pages(c, std::string(basis.name), {std::string(basis.about), kRadianceUnit, true}, planes);
}

Expected<std::vector<std::string>> write_error(const OutputContext& c) {
  if (!c.lightmap.has_light) return std::vector<std::string>{};
  return write_pages(c, "error", {"standard error of the luminance of E", kIrradianceUnit},
                     {{"Y", &c.lightmap.planes.plane("error")}});
}

namespace {
Expected<std::vector<std::string>> write_all(const OutputContext& c, const std::string& stem,
                                             const Meaning& meaning, const Planes& planes) {
  if (planes.names.empty()) return std::vector<std::string>{};
  std::vector<NamedPlane> named;
  for (const std::string& name : planes.names) named.push_back({name, &planes.plane(name)});
  return write_pages(c, stem, meaning, named);
}
}  // namespace

Expected<std::vector<std::string>> write_band_error(const OutputContext& c) {
  return write_all(c, "error_" + c.settings.basis,
                   {"standard error of the luminance of the basis, by band", kRadianceUnit, true},
                   c.lightmap.band_error);
}

Expected<std::vector<std::string>> write_measured(const OutputContext& c) {
  return write_all(c, "measured",
                   {"E, the basis and the standard error of E before the denoiser",
                    text("E and error: {}; basis: {}", kIrradianceUnit, kRadianceUnit), true},
                   c.lightmap.measured);
}

Expected<std::vector<std::string>> write_responses(const OutputContext& c) {
  std::vector<std::string> files;
  for (const uint32_t index : c.settings.quantities.responses) {
    const ResponseInfo& r = response_roster()[index];
    const std::string name(r.name);
    std::vector<NamedPlane> values;
    for (size_t s = 0; s < r.stored.size(); ++s)
      values.push_back({std::string(r.stored[s]), &c.lightmap.responses.plane(response_plane(r, s))});
    KILN_TRY(const std::vector<std::string> value_files,
             write_pages(c, name, {std::string(r.about), kShare}, values));
    KILN_TRY(const std::vector<std::string> error_files,
             write_pages(c, "error_" + name, {text("standard error of {}", name), kShare},
                         {{"Y", &c.lightmap.response_error.plane(name)}}));
    files.insert(files.end(), value_files.begin(), value_files.end());
    files.insert(files.end(), error_files.begin(), error_files.end());
  }
  return files;
}

Expected<std::vector<std::string>> write_samples(const OutputContext& c) {
  return write_pages(c, "samples", {"samples of the texel", kShare},
                     {{"Y", &c.lightmap.planes.plane("samples")}});
}

Expected<std::vector<std::string>> write_validity(const OutputContext& c) {
  std::vector<float> plane(c.lightmap.validity.size());
  for (size_t i = 0; i < plane.size(); ++i) plane[i] = static_cast<float>(c.lightmap.validity[i]);
  return write_pages(
      c, "validity",
      {"class of the texel: 0 empty, 1 measured, 2 pushed, 3 filled, 4 dilated, 5 inside", kShare},
      {{"Y", &plane}});
}

}  // namespace kiln
