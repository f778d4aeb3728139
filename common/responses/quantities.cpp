#include "common/responses/quantities.h"

#include <algorithm>

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr std::string_view kLight = "light", kProbes = "probes";
constexpr std::string_view kFalloffNames[kFalloffs] = {"none", "linear", "smooth"};

std::string quantity_names() {
  std::string out(kLight);
  for (const ResponseInfo& r : response_roster()) out += text(", {}", r.name);
  return out + text(", {}", kProbes);
}

}  // namespace

std::string_view falloff_name(Falloff falloff) {
  return kFalloffNames[static_cast<uint32_t>(falloff)];
}

Expected<Falloff> find_falloff(std::string_view name) {
  for (uint32_t i = 0; i < kFalloffs; ++i)
    if (kFalloffNames[i] == name) return static_cast<Falloff>(i);
  return fail(ErrorKind::kUsage, text("there is no falloff '{}': choose none, linear or smooth", name));
}

std::span<const ResponseInfo> response_roster() {
  return Responses::all();
}

std::string response_plane(const ResponseInfo& response, size_t stored) {
  return response.stored.size() == 1 ? std::string(response.name)
                                     : text("{}.{}", response.name, response.stored[stored]);
}

Expected<Quantities> parse_quantities(std::string_view list) {
  Quantities out;
  out.light = false;
  for (size_t at = 0; at <= list.size();) {
    const size_t comma = std::min(list.find(',', at), list.size());
    const std::string_view name = list.substr(at, comma - at);
    at = comma + 1;
    if (name == kLight) {
      out.light = true;
      continue;
    }
    if (name == kProbes) {
      out.probes = true;
      continue;
    }
    const std::span<const ResponseInfo> roster = response_roster();
    const auto found =
        std::find_if(roster.begin(), roster.end(), [&](const ResponseInfo& r) { return r.name == name; });
    if (found == roster.end())
      return fail(ErrorKind::kUsage,
                  text("there is no quantity '{}': choose from {}", name, quantity_names()));
    out.responses.push_back(static_cast<uint32_t>(found - roster.begin()));
  }
  std::sort(out.responses.begin(), out.responses.end());
  out.responses.erase(std::unique(out.responses.begin(), out.responses.end()), out.responses.end());
  return out;
}

std::string print_quantities(const Quantities& quantities) {
  std::string out = quantities.light ? std::string(kLight) : "";
  for (const uint32_t r : quantities.responses)
    out += text("{}{}", out.empty() ? "" : ",", response_roster()[r].name);
  if (quantities.probes) out += text("{}{}", out.empty() ? "" : ",", kProbes);
  return out;
}

MomentLayout::MomentLayout(uint32_t basis, const Quantities& quantities)
    : basis_(basis), quantities_(quantities) {
  planes_ = kMomentER;
  if (quantities.light) {
    functions_ = basis_roster()[basis].functions.size();
    planes_ = kMomentBasis + 3 * functions_;
    if (quantities.direct_apart) direct_ = planes_, planes_ += 3;
    if (quantities.all_light) all_light_ = planes_, planes_ += 3;
    if (quantities.cache_draws) cache_draws_ = planes_, planes_ += kCacheDraws;
  }
  if (quantities.probes) {
    pair_squares_ = planes_;
    planes_ += functions_;
    if (quantities.probe_visibility) {
      octahedral_ = planes_;
      distances_ = octahedral_ + 3 * kIrradianceSide * kIrradianceSide;
      planes_ = distances_ + 3 * kDistanceSide * kDistanceSide;
    }
  }
  for (const uint32_t r : quantities.responses) {
    first_.push_back(planes_);
    planes_ += 2 * response_roster()[r].components;
  }
}

std::vector<std::string> MomentLayout::names() const {
  std::vector<std::string> names{"inside", "pushed"};
  if (quantities_.light) {
    for (const char* name : {"E.R", "E.G", "E.B", "lum", "lum2"}) names.push_back(name);
    for (const std::string_view function : basis_roster()[basis_].functions)
      for (const char* channel : {".R", ".G", ".B"}) names.push_back(std::string(function) + channel);
    if (quantities_.direct_apart)
      for (const char* name : {"direct.R", "direct.G", "direct.B"}) names.push_back(name);
    if (quantities_.all_light)
      for (const char* name : {"all.R", "all.G", "all.B"}) names.push_back(name);
    if (quantities_.cache_draws)
      for (size_t k = 0; k < kCacheDraws; ++k) names.push_back(text("draw.{}", k));
  }
  if (quantities_.probes) {
    for (const std::string_view function : basis_roster()[basis_].functions)
      names.push_back(text("{}.pairs", function));
    if (quantities_.probe_visibility) {
      for (uint32_t t = 0; t < kIrradianceSide * kIrradianceSide; ++t)
        for (const char* channel : {"R", "G", "B"}) names.push_back(text("octahedral.{}.{}", t, channel));
      for (uint32_t t = 0; t < kDistanceSide * kDistanceSide; ++t)
        for (const char* moment : {"weight", "distance", "squares"})
          names.push_back(text("distance.{}.{}", t, moment));
    }
  }
  for (const uint32_t index : quantities_.responses) {
    const ResponseInfo& r = response_roster()[index];
    for (size_t c = 0; c < r.components; ++c)
      for (const char* moment : {"sum", "squares"}) names.push_back(text("{}.{}.{}", r.name, c, moment));
  }
  return names;
}

}  // namespace kiln
