#include "tests/analytic/in_process.h"

#include <bit>

#include "common/base/check.h"
#include "common/base/parallel.h"
#include "common/responses/quantities.h"

namespace kiln::test {
namespace {

struct SitePoint {
  Vec3 position, normal;
};

std::vector<SitePoint> site_points(const Bake& b, uint32_t site) {
  const uint32_t* record = b.atlas.sites.words.data() + b.atlas.sites.first_word[site];
  const int n = std::popcount(record[0]) + std::popcount(record[1]);
  std::vector<SitePoint> points;
  for (int i = 0; i < n; ++i) {
    const SitePick p = pick_site(b.atlas, site, (static_cast<float>(i) + 0.5f) / static_cast<float>(n));
    const Instance& instance = b.scene.instances[p.instance];
    const Mesh& m = b.scene.meshes[instance.mesh];
    const UVec3& t = m.triangles[p.triangle];
    const float b0 = 1 - p.b1 - p.b2;
    points.push_back(
        {transform_point(instance.to_world,
                         m.positions[t.x] * b0 + m.positions[t.y] * p.b1 + m.positions[t.z] * p.b2),
         normalize_or(transform_normal(instance.to_world,
                                       m.normals[t.x] * b0 + m.normals[t.y] * p.b1 + m.normals[t.z] * p.b2),
                      Vec3(0, 1, 0))});
  }
  return points;
}

uint32_t instance_of(const Atlas& atlas, uint32_t site) {
  return atlas.sites.words[atlas.sites.first_word[site] + 4];
}

}  // namespace

Bake bake(Scene scene, float texels_per_metre, uint32_t samples, TransportSettings settings,
          std::optional<uint32_t> only) {
  Bake b;
  AtlasSettings a;
  a.layout = AtlasSettings::Layout::kPack;
  a.texels_per_metre = texels_per_metre;
  a.cut_contacts = false;  // tests of transport: charts as the meshes have them
  auto atlas = build_atlas(scene, a);
  if (!atlas) throw std::runtime_error(atlas.error().message);
  b.atlas = *atlas;
  b.scene = scene;
  auto baker = Baker::create(std::move(scene), std::move(*atlas), settings, 2);
  if (!baker) throw std::runtime_error(baker.error().message);
  const auto sites = static_cast<uint32_t>(b.atlas.sites.size());
  const auto merged = std::make_shared<Accumulator>(sites, MomentLayout(settings.basis, settings.quantities));
  Accumulator& sums = *merged;
  b.sums = merged;
  constexpr size_t kRun = 64;
  std::vector<WorkUnit> units;
  for (uint32_t site = 0; site < sites; ++site) {
    if (only && instance_of(b.atlas, site) != *only) continue;
    if (units.empty() || units.back().sites.size() == kRun) units.push_back({units.size(), 0, samples, {}});
    units.back().sites.push_back(site);
  }
  if (!settings.quantities.responses.empty()) {
    const size_t count = units.size();
    for (WorkUnit& unit : units) unit.sample_count = samples / kReplicates;
    for (size_t i = 0; i < count; ++i) {
      units.push_back(units[i]);
      units.back().id = units.size() - 1;
      units.back().replicate = 1;
    }
  }
  std::vector<UnitResult> results(units.size());
  parallel_for(units.size(), [&](size_t i) { results[i] = *(*baker)->bake(units[i]); });
  for (size_t i = 0; i < units.size(); ++i) {
    KILN_CHECK(results[i].nonfinite == 0);
    KILN_CHECK(sums.add(units[i], results[i]).has_value());
  }
  b.map = sums.resolve(b.atlas);
  for (uint32_t site = 0; site < sites; ++site) {
    if (sums.samples(site) == 0) continue;
    const uint32_t t = b.atlas.sites.texel[site];
    const auto plane = [&](size_t p) {
      if (!b.map.has_light) return Vec3(0);
      return Vec3(b.map.planes.data[p][t], b.map.planes.data[p + 1][t], b.map.planes.data[p + 2][t]);
    };
    BakedTexel out{};
    for (const SitePoint& p : site_points(b, site)) out.position += p.position, out.ns += p.normal;
    out.position /= static_cast<float>(site_points(b, site).size());
    out.ns = normalize_or(out.ns, Vec3(0, 1, 0));
    out.e = plane(0);
    const auto estimate = sums.estimate(site);
    out.luminance = estimate.mean;
    out.standard_error = estimate.standard_error;
    out.inside = estimate.inside;
    out.pushed = estimate.pushed;
    if (settings.basis == 1 && b.map.has_light) {
      out.l0 = plane(3);
      for (int k = 0; k < 3; ++k) out.l1[k] = plane(6 + 3 * k);
    }
    out.instance = instance_of(b.atlas, site);
    out.site = site;
    out.coverage = static_cast<double>(site_points(b, site).size()) / 64;
    b.texels.push_back(out);
  }
  return b;
}

double texel_average(const Bake& b, uint32_t site, const std::function<double(const Vec3&, const Vec3&)>& f) {
  double sum = 0;
  const auto points = site_points(b, site);
  for (const SitePoint& p : points) sum += f(p.position, p.normal);
  return sum / static_cast<double>(points.size());
}

Comparison compare(const Bake& b, const std::function<double(uint32_t)>& truth, uint32_t instance) {
  Comparison c;
  size_t within = 0;
  for (const BakedTexel& texel : b.texels) {
    if (texel.instance != instance) continue;
    const double t = truth(texel.site);
    c.mean += texel.luminance;
    c.true_mean += t;
    within += std::abs(texel.luminance - t) <= 3 * texel.standard_error;
    ++c.texels;
  }
  c.mean /= static_cast<double>(c.texels);
  c.true_mean /= static_cast<double>(c.texels);
  c.share_within_3 = static_cast<double>(within) / static_cast<double>(c.texels);
  return c;
}

}  // namespace kiln::test
