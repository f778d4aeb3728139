// The quantities a bake is asked for, and the layout of their sums in a unit result.
#pragma once

#include "common/responses/basis.h"
#include "common/responses/response.h"

namespace kiln {

// --quantities: light, and entries of the response roster; and what of light has sums of its own.
struct Quantities {
  bool light = true;
  std::vector<uint32_t> responses{};  // indices into response_roster(), ascending
  bool direct_apart = false;          // --split: E straight from emitters
  // E of all lights, those included that a texel is lit by in reflections alone (`bake: indirect`): what an
  // irradiance cache has to hold.
  bool all_light = false;
  // Errors of an irradiance cache, drawn again and carried along the paths that end there: kCacheDraws draws
  // of the error that a texel has by way of it (docs/samples.md, "What texels share").
  bool cache_draws = false;
  // Receivers are probes: points that gather light from the whole sphere (docs/probes.md).
  bool probes = false;
  bool probe_visibility = false;  // and distances, for the query that knows what a probe sees
  bool operator==(const Quantities&) const = default;
};

constexpr size_t kCacheDraws = 4;  // in each replicate

// Texels a side of the octahedral maps of a probe, without borders. (Majercik et al. 2019, section 3.)
constexpr uint32_t kIrradianceSide = 8, kDistanceSide = 16;

// "light,ao" in any order. Errors list the names.
Expected<Quantities> parse_quantities(std::string_view list);
std::string print_quantities(const Quantities& quantities);

// The planes of a texel's moment record: "inside" and "pushed"; if light is asked for, E, its
// luminance, the square of that, the basis (function major, R G B), the E that are apart and the errors drawn
// of its luminance; then the sum and the sum of squares of each response's components. Of probes: E is the
// mean radiance of the sphere, the basis sh_l2, then for each of its functions the sum over pairs of samples
// of the square of the luminance of their mean; with visibility E in the directions of an octahedral map of
// kIrradianceSide^2 texels (texel major, R G B), and in those of one of kDistanceSide^2 texels the sums of
// weight, weight x distance and weight x distance^2.
class MomentLayout {
 public:
  explicit MomentLayout(uint32_t basis = 0, const Quantities& quantities = {});
  size_t planes() const { return planes_; }
  bool has_light() const { return quantities_.light; }
  uint32_t basis() const { return basis_; }
  size_t functions() const { return functions_; }  // in the basis; 0 without light
  const Quantities& quantities() const { return quantities_; }
  // First planes of E from emitters alone and of E of all lights; only if quantities() ask for them.
  size_t direct() const { return direct_; }
  size_t all_light() const { return all_light_; }
  size_t cache_draws() const { return cache_draws_; }  // the first of kCacheDraws planes; only if asked for
  // First planes of the squares of pairs, the octahedral E and the distances; only of probes, the last two
  // only with visibility.
  size_t pair_squares() const { return pair_squares_; }
  size_t octahedral() const { return octahedral_; }
  size_t distances() const { return distances_; }
  // First plane of entry k of quantities().responses.
  size_t response(size_t k) const { return first_[k]; }
  std::vector<std::string> names() const;

 private:
  uint32_t basis_;
  Quantities quantities_;
  size_t functions_ = 0, planes_ = 0, direct_ = 0, all_light_ = 0, cache_draws_ = 0;
  size_t pair_squares_ = 0, octahedral_ = 0, distances_ = 0;
  std::vector<size_t> first_;
};

}  // namespace kiln
