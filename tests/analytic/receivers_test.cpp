// A kind of receivers in one file: points that lie on no surface, baked by the same baker as texels.
#include <cmath>

#include "tests/analytic/scene_maker.h"
#include "worker/bake/path_baker.h"

namespace kiln::test {
namespace {

// Points that look upwards.
class PointReceivers {
 public:
  explicit PointReceivers(std::vector<Vec3> points) : points_(std::move(points)) {}
  size_t size() const { return points_.size(); }
  uint32_t key(uint32_t index) const { return index; }
  using Sums = Film;

  class Open {
   public:
    Open(const PointReceivers& r, const Surfaces&, const Tracer&, uint32_t index)
        : point_(r.points_[index]) {}
    SurfacePoint at(const SampleStream&) const {
      SurfacePoint p{};
      p.position = point_;
      p.ng = p.ns = Vec3(0, 1, 0);
      return p;
    }
    std::optional<SitePlaces::Place> instead_of(const SampleStream&, uint64_t&) const { return std::nullopt; }

   private:
    Vec3 point_;
  };
  std::optional<KnownIrradiance> known(const Scene&, const IrradianceCache&) const { return std::nullopt; }

 private:
  std::vector<Vec3> points_;
};
static_assert(ReceiverKind<PointReceivers>);

TEST(Receivers, PointsSeeTheSkyBesideAWall) {
  SceneMaker make;
  make.lambert(Vec3(0.5f));
  make.quad(Vec3(0, 0, 100), Vec3(0, 0, -200), Vec3(0, 1, 0));
  TransportSettings settings;
  settings.quantities = *parse_quantities("sky");
  const std::vector<Vec3> points{{0.25f, 0, 0}, {0.5f, 0.25f, 0}, {1, 0.5f, 0}, {2, 1.5f, 0}};
  PathBaker<PointReceivers> baker(PointReceivers(points), settings);
  ASSERT_TRUE(baker.build(make.take(), 1));
  constexpr uint32_t kSamples = 1 << 14;
  const auto result = baker.bake({1, 0, kSamples, {0, 1, 2, 3}}, nullptr);
  ASSERT_TRUE(result);
  const size_t sky = MomentLayout(settings.basis, settings.quantities).response(0);
  for (size_t i = 0; i < points.size(); ++i) {
    const double h = std::max(0.0, 1.0 - points[i].y), x = points[i].x;
    const double truth = 1 - 0.5 * (1 - x / std::sqrt(x * x + h * h));
    EXPECT_NEAR(result->moments[i * result->plane_count + sky] / kSamples, truth, 0.005 * truth) << i;
  }
}

}  // namespace
}  // namespace kiln::test
