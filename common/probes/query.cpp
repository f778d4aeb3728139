#include "common/probes/query.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "common/probes/octahedral.h"

namespace kiln {
namespace {

constexpr float kLeastWeight = 1e-6f;  // of a probe that sees nothing: it counts where no other does
constexpr float kCrush = 0.2f;         // weights below fall with their cube

// The cell of a brick around a point in finest spacings: visit(probe, weight) for its 8 corners.
template <class Visit>
void for_each_corner(const ProbeBrick& b, const DVec3& at, const Visit& visit) {
  const double cell = 1u << b.level;
  uint32_t first[3];
  float share[3];
  for (int k = 0; k < 3; ++k) {
    const double local = std::clamp((at[k] - b.corner[k]) / cell, 0.0, double{kBrickCells});
    first[k] = std::min(static_cast<uint32_t>(local), kBrickCells - 1);
    share[k] = static_cast<float>(local - first[k]);
  }
  for (uint32_t corner = 0; corner < 8; ++corner) {
    float weight = 1;
    uint32_t point[3];
    for (uint32_t k = 0; k < 3; ++k) {
      const uint32_t upper = corner >> k & 1;
      point[k] = first[k] + upper;
      weight *= upper ? share[k] : 1 - share[k];
    }
    visit(b.probes[point[0] + kBrickSide * (point[1] + kBrickSide * point[2])], weight);
  }
}

// Bilinear, across borders too.
template <class Value>
Value read_map(const Value* map, uint32_t side, const Vec3& direction) {
  const Vec2 p = octahedral_place(direction) * static_cast<float>(side) + Vec2(0.5f);  // in the bordered map
  const Vec2 low = glm::floor(p), f = p - low;
  const auto texel = [&](uint32_t dx, uint32_t dy) {
    uint32_t x = std::min(static_cast<uint32_t>(low.x) + dx, side + 1),
             y = std::min(static_cast<uint32_t>(low.y) + dy, side + 1);
    octahedral_inside(side, x, y);
    return map[y * side + x];
  };
  return (texel(0, 0) * (1 - f.x) + texel(1, 0) * f.x) * (1 - f.y) +
         (texel(0, 1) * (1 - f.x) + texel(1, 1) * f.x) * f.y;
}

// Weights of a volume's probes at a point: of a surface if there is a normal.
class Query {
 public:
  Query(const ProbeVolume& volume, const ProbeField& field, const Vec3& position,
        const std::optional<Vec3>& normal, const ProbeQuery& settings)
      : volume_(volume),
        field_(field),
        position_(position),
        normal_(normal),
        settings_(settings),
        visibility_(settings.visibility && volume.visibility) {}

  ProbeWeights find() {
    const DVec3 at = (DVec3(position_) - volume_.low) / volume_.spacing;
    const DVec3 end(volume_.roots * volume_.root_size()), inside = glm::clamp(at, DVec3(0), end);
    const double off = length(at - inside) / (1u << (volume_.levels - 1));
    if (!(off < 1)) return {};
    const float sum = add_bricks(find_brick(volume_, inside), inside);
    if (!(sum > 0)) return {};
    for (uint32_t i = 0; i < out_.count; ++i) out_.weight[i] /= sum;
    out_.inside = static_cast<float>(1 - off);
    return out_;
  }

 private:
  // The brick's probes, and where it fades those of the larger one it is a part of, and so on; `at`: in
  // finest spacings. Returns the sum of weights.
  float add_bricks(uint32_t index, const DVec3& at) {
    float sum = 0, left = 1;
    for (;;) {
      const ProbeBrick& b = volume_.bricks[index];
      const bool is_root = b.parent == index;
      const float own = is_root ? 1.0f : fade(b, at);
      if (own > 0 && add_cell(b, at, left * own)) {
        sum += left * own;
        left *= 1 - own;
      }
      if (is_root || !(left > 0)) return sum;
      index = b.parent;
    }
  }

  // 0 at a neighbour of larger spacing, 1 from one cell off.
  static float fade(const ProbeBrick& b, const DVec3& at) {
    if (!b.coarser) return 1;
    double nearest = 1;
    const double cell = 1u << b.level;
    for (uint32_t side = 0; side < 27; ++side) {
      if (!(b.coarser >> side & 1)) continue;
      const int step[3] = {static_cast<int>(side % 3) - 1, static_cast<int>(side / 3 % 3) - 1,
                           static_cast<int>(side / 9) - 1};
      double away = 0;
      for (int k = 0; k < 3; ++k) {
        const double from_low = at[k] - b.corner[k];
        if (step[k] < 0) away = std::max(away, from_low / cell);
        if (step[k] > 0) away = std::max(away, (b.size() - from_low) / cell);
      }
      nearest = std::min(nearest, away);
    }
    return static_cast<float>(std::max(0.0, nearest));
  }

  // Adds the 8 probes of the cell, with weights that add up to `share`; false if none of them has light.
  bool add_cell(const ProbeBrick& b, const DVec3& at, float share) {
    const auto spacing = static_cast<float>(volume_.spacing_of(b));
    const uint32_t first = out_.count;
    float sum = 0;
    for_each_corner(b, at, [&](uint32_t probe, float trilinear) {
      if (field_.state[probe] == ProbeState::kInactive || !(trilinear > 0)) return;
      out_.probe[out_.count] = probe;
      out_.weight[out_.count] = trilinear * weight_of(probe, spacing);
      sum += out_.weight[out_.count++];
    });
    for (uint32_t i = first; i < out_.count; ++i) out_.weight[i] *= share / sum;
    return out_.count > first;
  }

  float weight_of(uint32_t probe, float spacing) const {
    const Vec3 to_probe = field_.place[probe] - position_;
    float weight = 1;
    Vec3 from = position_;
    if (normal_) {
      const float distance = length(to_probe);
      const float facing = distance > 0 ? dot(to_probe, *normal_) / distance : 1.0f,
                  half = 0.5f * (facing + 1);
      weight = half * half + 0.2f;
      from += *normal_ * (settings_.bias * spacing);
    }
    if (visibility_) weight *= seen(probe, from);
    weight = std::max(kLeastWeight, weight);
    if (weight < kCrush) weight *= weight * weight / (kCrush * kCrush);
    return weight;
  }

  // Chebyshev's bound of the share of distances beyond, cubed.
  float seen(uint32_t probe, const Vec3& from) const {
    const Vec3 d = from - field_.place[probe];
    const float r = length(d);
    if (!(r > 0)) return 1;
    const Vec2 m = read_map(&field_.distance[size_t{probe} * kDistanceTexels], kDistanceSide, d / r);
    if (!(r > m.x)) return 1;
    const float variance = std::abs(m.y - m.x * m.x), beyond = r - m.x;
    const float share = variance / (variance + beyond * beyond);
    return share * share * share;
  }

  const ProbeVolume& volume_;
  const ProbeField& field_;
  const Vec3 position_;
  const std::optional<Vec3> normal_;
  const ProbeQuery& settings_;
  const bool visibility_;
  ProbeWeights out_;
};

}  // namespace

ProbeWeights query_weights(const ProbeVolume& volume, const ProbeField& field, const Vec3& position,
                           const std::optional<Vec3>& normal, const ProbeQuery& settings) {
  return Query(volume, field, position, normal, settings).find();
}

ProbeLight query_volume(const ProbeVolume& volume, const ProbeField& field, const Vec3& position,
                        const Vec3& normal, const ProbeQuery& settings) {
  const ProbeWeights w = query_weights(volume, field, position, normal, settings);
  const bool octahedral = settings.octahedral && volume.visibility;
  ProbeLight out{Vec3(0.0f), w.inside};
  for (uint32_t i = 0; i < w.count; ++i) {
    const uint32_t probe = w.probe[i];
    const Vec3 e =
        octahedral ? read_map(&field.irradiance[size_t{probe} * kIrradianceTexels], kIrradianceSide, normal)
                   : harmonic_irradiance(field.light[probe], normal);
    out.irradiance += w.weight[i] * glm::max(e, Vec3(0.0f));
  }
  return out;
}

Harmonics query_harmonics(const ProbeVolume& volume, const ProbeField& field, const Vec3& position,
                          const ProbeQuery& settings) {
  const ProbeWeights w = query_weights(volume, field, position, std::nullopt, settings);
  Harmonics out{};
  for (uint32_t i = 0; i < w.count; ++i)
    for (size_t k = 0; k < kHarmonics; ++k) out[k] += w.weight[i] * field.light[w.probe[i]][k];
  return out;
}

Harmonics harmonics_in_air(const ProbeVolume& volume, const ProbeField& field, const DVec3& at) {
  const DVec3 inside = glm::clamp(at, DVec3(0), DVec3(volume.roots * volume.root_size()));
  Harmonics out{};
  for_each_corner(volume.bricks[find_brick(volume, inside)], inside, [&](uint32_t probe, float weight) {
    for (size_t k = 0; k < kHarmonics; ++k) out[k] += weight * field.light[probe][k];
  });
  return out;
}

ProbeLight query_probes(std::span<const ProbeVolume> volumes, const ProbeField& field, const Vec3& position,
                        const Vec3& normal, const ProbeQuery& settings) {
  std::vector<size_t> order(volumes.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return volumes[a].spacing < volumes[b].spacing; });
  Vec3 sum(0.0f);
  float left = 1, most = 0;
  for (const size_t v : order) {
    const ProbeLight light = query_volume(volumes[v], field, position, normal, settings);
    sum += light.irradiance * (left * light.weight);
    left *= 1 - light.weight;
    most = std::max(most, light.weight);
  }
  if (!(left < 1)) return {};
  return {sum / (1 - left), most};
}

}  // namespace kiln
