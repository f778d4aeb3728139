#include <algorithm>

#include "common/base/format.h"
#include "common/base/parallel.h"
#include "coordinator/scene/lods/lods.h"
#include "coordinator/scene/lods/refine.h"

namespace kiln {
namespace {

// Points along an edge of a face at which the fit is measured: no further apart than the allowed distance, so
// that a hole of that size is found, up to a limit on the work.
uint32_t grid_steps(double longest, double reach) {
  constexpr double kMaxSteps = 16;
  return static_cast<uint32_t>(std::clamp(std::ceil(longest / reach), 2.0, kMaxSteps));
}

struct Refusal {
  std::string why;  // empty: none
  double excess = 0;
};

class MeshProjection {
 public:
  MeshProjection(const Display& display, size_t index, const SourceSurface& source,
                 const LodSettings& settings)
      : shown_(display.shown[index]),
        set_(display.sets[shown_.set]),
        source_(source),
        split_(settings.split),
        surface_(display.meshes[shown_.place.mesh], shown_.place.to_world) {
    search_.reach = set_.most_distance > 0  ? set_.most_distance
                    : settings.distance > 0 ? settings.distance
                                            : kLodDistance * source.size();
  }

  void run(ProjectedCharts& charts, DisplayFit& fit) {
    const std::vector<DisplayFace> faces = refine_faces(surface_, source_, search_, split_);
    fit.name = shown_.place.name;
    fit.level = shown_.level;
    fit.baked = set_.baked;
    fit.limit = search_.reach;
    fit.triangles = surface_.mesh().triangles.size();
    fit.faces = faces.size();
    double area = 0;
    for (const DisplayFace& f : faces) measure(f, fit, area);
    fit.mean = area > 0 ? fit.mean / area : 0;
    write(faces, charts);
  }

  // The error message, or empty.
  std::string refusal() const {
    if (refusal_.why.empty()) return {};
    const std::string who = shown_.place.node == set_.node
                                ? text("{} against its {}", set_.name, set_.baked)
                                : text("'{}' (level {} of {}) against {}", shown_.place.name, shown_.level,
                                       set_.name, set_.baked);
    return text("{}: {}", who, refusal_.why);
  }

 private:
  void measure(const DisplayFace& f, DisplayFit& fit, double& area) {
    DVec3 p[3];
    for (int k = 0; k < 3; ++k) p[k] = surface_.position(f.triangle, f.b[k]);
    const double longest = std::max({length(p[1] - p[0]), length(p[2] - p[1]), length(p[0] - p[2])});
    const uint32_t steps = grid_steps(longest, search_.reach);
    const double density = source_.texels_per_metre(f.placement);
    double sum = 0;
    uint32_t count = 0;
    for (uint32_t y = 0; y <= steps; ++y)
      for (uint32_t x = 0; x + y <= steps; ++x) {
        const double b1 = static_cast<double>(x) / steps, b2 = static_cast<double>(y) / steps;
        const DisplayPoint q = surface_.point(f.triangle, f.at(b1, b2));
        const auto matched = source_.nearest(q, search_);
        if (!matched) refuse_missing(q);
        const LitPoint s = matched && matched->placement == f.placement
                               ? *matched
                               : place_in_chart(source_, q, search_, f.placement);
        const double shift = length(f.lookup(b1, b2) - s.texels);
        if (matched) check(q, s, shift, density);
        if (s.distance > fit.worst) {
          fit.worst = s.distance;
          fit.worst_at = q.at;
          fit.worst_texels = s.distance * density;
        }
        fit.shift_texels = std::max(fit.shift_texels, shift);
        sum += s.distance;
        ++count;
      }
    const double own = 0.5 * length(cross(p[1] - p[0], p[2] - p[0]));
    area += own;
    fit.mean += own * sum / count;
  }

  // The worst point gives the reason.
  void refuse(double excess, std::string why) {
    if (!refusal_.why.empty() && excess <= refusal_.excess) return;
    refusal_ = {std::move(why), excess};
  }

  void refuse_missing(const DisplayPoint& q) {
    const LitPoint any = source_.nearest_of_any_normal(q);
    if (any.distance > search_.reach)
      refuse(any.distance,
             text("at ({:.3f}, {:.3f}, {:.3f}) the baked surface is {:.3g} m away, {:.3g} m are "
                  "allowed",
                  q.at.x, q.at.y, q.at.z, any.distance, search_.reach));
    else
      refuse(any.distance,
             text("at ({:.3f}, {:.3f}, {:.3f}) no baked surface within {:.3g} m faces its way: the "
                  "nearest, at {:.3g} m, is turned by more than 60 degrees",
                  q.at.x, q.at.y, q.at.z, search_.reach, any.distance));
  }

  // There is a match, but the triangle's chart may not reach it.
  void check(const DisplayPoint& q, const LitPoint& s, double shift, double density) {
    constexpr double kBlur = 2;  // texels: within the blur of a bilinear lookup
    const bool shifted = density > 0 && shift > std::max(kBlur, split_);
    const double metres = std::max(s.distance, shifted ? shift / density : 0.0);
    if (metres <= search_.reach) return;
    refuse(metres,
           text("at ({:.3f}, {:.3f}, {:.3f}) its triangle gets the light of a place {:.3g} m off, {:.3g} m "
                "are allowed{}",
                q.at.x, q.at.y, q.at.z, metres, search_.reach,
                split_ > 0 ? "" : " (--lod-split would split it)"));
  }

  void write(const std::vector<DisplayFace>& faces, ProjectedCharts& out) const {
    for (const DisplayFace& f : faces) out.placement.push_back(f.placement);
    std::sort(out.placement.begin(), out.placement.end());
    out.placement.erase(std::unique(out.placement.begin(), out.placement.end()), out.placement.end());
    out.charts.chart_count = static_cast<uint32_t>(out.placement.size());
    for (const DisplayFace& f : faces) {
      const auto chart = std::lower_bound(out.placement.begin(), out.placement.end(), f.placement);
      out.charts.chart_of_face.push_back(static_cast<uint32_t>(chart - out.placement.begin()));
      FacePart part;
      part.triangle = f.triangle;
      for (int k = 0; k < 3; ++k) {
        part.corner[k] = Vec2(f.b[k]);  // sums of halves: exact
        out.charts.corner_uv.push_back(Vec2(f.texels[k]));
      }
      out.charts.parts.push_back(part);
    }
  }

  const DisplayMesh& shown_;
  const DisplaySet& set_;
  const SourceSurface& source_;
  const double split_;
  DisplaySurface surface_;
  SurfaceSearch search_;
  Refusal refusal_;
};

}  // namespace

Expected<Projection> project_display(const Display& display, const Scene& scene, const Atlas& atlas,
                                     const LodSettings& settings) {
  const size_t count = display.shown.size();
  Projection out;
  out.charts.resize(count);
  out.fits.resize(count);
  std::vector<std::optional<SourceSurface>> sources(display.sets.size());
  for (const DisplayMesh& m : display.shown)
    if (!sources[m.set]) sources[m.set].emplace(scene, atlas, display.sets[m.set].sources);
  std::vector<std::string> refusals(count);
  parallel_for(
      count,
      [&](size_t i) {
        MeshProjection projection(display, i, *sources[display.shown[i].set], settings);
        projection.run(out.charts[i], out.fits[i]);
        refusals[i] = projection.refusal();
      },
      settings.threads);
  std::string all;
  for (const std::string& r : refusals)
    if (!r.empty()) all += (all.empty() ? "" : "; ") + r;
  if (!all.empty())
    return fail(
        ErrorKind::kInvalidInput,
        text("levels of detail do not fit the baked surface: {}. Move them onto it, bake another level "
             "(--lod, extras.kiln.proxy) or allow more (--lod-distance, extras.kiln.lod_distance)",
             all));
  return out;
}

}  // namespace kiln
