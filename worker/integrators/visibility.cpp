#include "worker/integrators/visibility.h"

#include "common/math/frame.h"
#include "common/math/sequence_batch.h"
#include "common/math/warp.h"
#include "worker/integrators/dimensions.h"

namespace kiln {
namespace {

class VisibilityIntegrator final : public Integrator {
 public:
  VisibilityIntegrator(const Surfaces& surfaces, const Tracer& tracer, const TransportSettings& settings)
      : surfaces_(surfaces), tracer_(tracer), settings_(settings) {}

  std::unique_ptr<Workspace> make_workspace() const override { return std::make_unique<Batch>(); }

  void sample(std::span<Task> tasks, Workspace& workspace, const KnownIrradiance*) const override {
    auto& b = static_cast<Batch&>(workspace);
    b.samples.clear();
    for (uint32_t i = 0; i < tasks.size(); ++i) {
      b.samples.add(tasks[i].stream);
      b.all[i] = i;
    }
    b.samples.pairs(dimension(0, kDirection), b.all, tasks.size(), b.u, b.v);
    for (size_t i = 0; i < tasks.size(); ++i) trace(tasks[i], Vec2(b.u[i], b.v[i]));
  }

 private:
  struct Batch final : Workspace {
    SampleBatch samples;
    uint32_t all[kBatch];
    float u[kBatch], v[kBatch];
  };

  void trace(Task& task, const Vec2& u) const {
    const SurfacePoint& at = task.receiver;
    const Vec3 local = primary_direction(settings_.primary, u);
    PrimaryRay& primary = task.radiance.primary;
    primary.direction = Frame(at.ns).to_world(local);
    if (!(dot(primary.direction, at.ng) > 0.0f)) return;
    primary.weight = primary_weight(local.z, primary_pdf(settings_.primary, local.z));
    ++task.radiance.rays;
    const Vec3 origin = offset_origin(at.position, at.ng, at.error);
    const Hit hit =
        tracer_.intersect({origin, primary.direction}, task.stream.bits(dimension(0, kDirection)));
    if (!hit.valid()) return;
    primary.distance = hit.t;
    if (!surfaces_.kind(hit.instance).double_sided)
      task.radiance.inside =
          dot(primary.direction, surfaces_.at(hit.instance, hit.triangle, hit.b1, hit.b2).ng) > 0.0f;
  }

  const Surfaces& surfaces_;
  const Tracer& tracer_;
  const TransportSettings settings_;
};

}  // namespace

std::unique_ptr<Integrator> make_visibility(const Surfaces& surfaces, const Tracer& tracer,
                                            const TransportSettings& settings) {
  return std::make_unique<VisibilityIntegrator>(surfaces, tracer, settings);
}

}  // namespace kiln
