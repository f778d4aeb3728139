#include "coordinator/scene/lods/refine.h"

#include <algorithm>
#include <array>
#include <map>
#include <set>

#include "common/unwrap/charts.h"

namespace kiln {
namespace {

constexpr uint32_t kMaxPasses = 10;  // halvings of an edge
// Splitting stops at this many faces: a display mesh must stay cheap to draw.
constexpr size_t most_faces(size_t triangles) {
  return 64 * triangles + 4096;
}

using Side = std::pair<uint32_t, uint32_t>;  // welds, ascending
Side side_of(const DisplayFace& f, int k) {
  return std::minmax(f.weld[k], f.weld[(k + 1) % 3]);
}

// Points where a face is compared with the surface: corners, edge midpoints, centre.
constexpr int kProbes = 7;
constexpr double kProbe[kProbes][2] = {
    {0, 0}, {1, 0}, {0, 1}, {0.5, 0}, {0.5, 0.5}, {0, 0.5}, {1.0 / 3, 1.0 / 3}};

class Evaluation {
 public:
  Evaluation(const DisplaySurface& display, const SourceSurface& source, const SurfaceSearch& search,
             double split)
      : display_(display), source_(source), search_(search), split_(split) {}

  void operator()(DisplayFace& face) {
    for (int i = 0; i < kProbes; ++i) {
      point_[i] = display_.point(face.triangle, face.at(kProbe[i][0], kProbe[i][1]));
      free_[i] = source_.nearest(point_[i], search_);
    }
    choose_chart(face);
    for (int k = 0; k < 3; ++k) face.texels[k] = place_[k].texels;
    find_wants(face);
    face.is_new = false;
  }

 private:
  // Of the charts nearest to its probes, the one nearest to all of them together.
  void choose_chart(DisplayFace& face) {
    std::vector<uint32_t> charts;
    for (const auto& f : free_)
      if (f) charts.push_back(f->placement);
    std::sort(charts.begin(), charts.end());
    charts.erase(std::unique(charts.begin(), charts.end()), charts.end());
    if (charts.empty()) charts.push_back(source_.nearest_of_any_normal(point_[6]).placement);
    double least = std::numeric_limits<double>::infinity();
    for (const uint32_t chart : charts) {
      std::array<LitPoint, kProbes> place;
      double cost = 0;
      for (int i = 0; i < kProbes; ++i) {
        const bool own = free_[i] && free_[i]->placement == chart;
        const auto matched = own ? free_[i] : source_.nearest(point_[i], search_, chart);
        place[i] = matched ? *matched : source_.nearest_of_any_normal(point_[i], chart);
        // Without a match: at least what the worst match within reach costs.
        cost += matched ? matched->cost
                        : 2 * search_.reach * search_.reach + place[i].distance * place[i].distance;
      }
      if (cost >= least) continue;
      least = cost;
      face.placement = chart;
      std::copy(place.begin(), place.end(), place_);
    }
  }

  // Edges near probes whose lookup is too far off.
  void find_wants(DisplayFace& face) const {
    if (split_ <= 0) return;
    const double density = source_.texels_per_metre(face.placement);
    bool near[3] = {};
    for (int i = 0; i < kProbes; ++i) {
      if (!free_[i]) continue;  // refused later: splitting does not help
      const DVec2 miss = face.lookup(kProbe[i][0], kProbe[i][1]) - place_[i].texels;
      const double texels = length(miss) + length(place_[i].at - free_[i]->at) * density;
      if (!(texels > split_)) continue;
      if (i < 3) near[i] = near[(i + 2) % 3] = true;
      if (i >= 3 && i < 6) near[i - 3] = true;
      if (i == 6) near[0] = near[1] = near[2] = true;
    }
    for (int k = 0; k < 3; ++k)  // edges shorter than a texel make no difference
      face.wants[k] = near[k] && length(point_[(k + 1) % 3].at - point_[k].at) * density > 1;
  }

  const DisplaySurface& display_;
  const SourceSurface& source_;
  const SurfaceSearch& search_;
  const double split_;
  DisplayPoint point_[kProbes];
  std::optional<LitPoint> free_[kProbes];
  LitPoint place_[kProbes];
};

// Splits faces at the midpoints of marked edges; creates midpoint welds as needed.
class Splitter {
 public:
  Splitter(const std::set<Side>& marked, uint32_t& next_weld) : marked_(marked), next_weld_(next_weld) {}

  void split(const DisplayFace& f, std::vector<DisplayFace>& out) {
    bool cut[3];
    int count = 0;
    for (int k = 0; k < 3; ++k) count += cut[k] = marked_.count(side_of(f, k)) != 0;
    if (count == 0) {
      out.push_back(f);
      return;
    }
    Corner c[3], m[3];
    for (int k = 0; k < 3; ++k) c[k] = {f.b[k], f.weld[k]};
    for (int k = 0; k < 3; ++k)
      if (cut[k]) m[k] = {0.5 * (f.b[k] + f.b[(k + 1) % 3]), middle(side_of(f, k))};
    if (count == 3) {
      for (int k = 0; k < 3; ++k) add(f, c[k], m[k], m[(k + 2) % 3], out);
      add(f, m[0], m[1], m[2], out);
      return;
    }
    int s = 0;  // count 1: the split edge; count 2: the edge before both
    while (count == 1 ? !cut[s] : cut[s]) ++s;
    const int t = (s + 1) % 3, u = (s + 2) % 3;
    if (count == 1) {
      add(f, c[s], m[s], c[u], out);
      add(f, m[s], c[t], c[u], out);
    } else {  // edges t and u are split: the tip at corner u, and the rest along edge s
      add(f, m[t], c[u], m[u], out);
      add(f, c[s], m[t], m[u], out);
      add(f, c[s], c[t], m[t], out);
    }
  }

 private:
  struct Corner {
    DVec2 b;
    uint32_t weld;
  };
  uint32_t middle(const Side& edge) {
    const auto [at, added] = middles_.try_emplace(edge, next_weld_);
    next_weld_ += added;
    return at->second;
  }
  static void add(const DisplayFace& of, const Corner& a, const Corner& b, const Corner& c,
                  std::vector<DisplayFace>& out) {
    DisplayFace f;
    f.triangle = of.triangle;
    f.b[0] = a.b, f.b[1] = b.b, f.b[2] = c.b;
    f.weld[0] = a.weld, f.weld[1] = b.weld, f.weld[2] = c.weld;
    out.push_back(f);
  }

  const std::set<Side>& marked_;
  uint32_t& next_weld_;
  std::map<Side, uint32_t> middles_;
};

DVec3 unit_or(const DVec3& v, const DVec3& otherwise) {
  const double size = length(v);
  return size > 0 ? v / size : otherwise;
}

}  // namespace

DisplaySurface::DisplaySurface(const Mesh& mesh, const Mat4x3& to_world)
    : mesh_(mesh), to_world_(to_world), side_(determinant(to_world) < 0 ? -1 : 1) {}

DVec3 DisplaySurface::position(uint32_t triangle, const DVec2& b) const {
  const UVec3& v = mesh_.triangles[triangle];
  DVec3 p[3];
  for (int k = 0; k < 3; ++k) p[k] = DVec3(transform_point(to_world_, mesh_.positions[v[k]]));
  return p[0] + b.x * (p[1] - p[0]) + b.y * (p[2] - p[0]);
}

DisplayPoint DisplaySurface::point(uint32_t triangle, const DVec2& b) const {
  const UVec3& v = mesh_.triangles[triangle];
  DVec3 p[3], n[3];
  for (int k = 0; k < 3; ++k) {
    p[k] = DVec3(transform_point(to_world_, mesh_.positions[v[k]]));
    n[k] = DVec3(mesh_.normals[v[k]]);
  }
  DisplayPoint out;
  out.at = p[0] + b.x * (p[1] - p[0]) + b.y * (p[2] - p[0]);
  out.facing = unit_or(side_ * cross(p[1] - p[0], p[2] - p[0]), DVec3(0, 1, 0));
  const Vec3 n_local((1 - b.x - b.y) * n[0] + b.x * n[1] + b.y * n[2]);
  out.normal = unit_or(DVec3(transform_normal(to_world_, n_local)), out.facing);
  return out;
}

LitPoint place_in_chart(const SourceSurface& source, const DisplayPoint& point, const SurfaceSearch& search,
                        uint32_t placement) {
  const auto matched = source.nearest(point, search, placement);
  return matched ? *matched : source.nearest_of_any_normal(point, placement);
}

std::vector<DisplayFace> refine_faces(const DisplaySurface& display, const SourceSurface& source,
                                      const SurfaceSearch& search, double split) {
  const Mesh& mesh = display.mesh();
  const std::vector<uint32_t> weld = weld_corners(mesh, {});
  uint32_t next_weld = 0;
  std::vector<DisplayFace> faces(mesh.triangles.size());
  for (uint32_t t = 0; t < faces.size(); ++t) {
    faces[t].triangle = t;
    faces[t].b[0] = {0, 0}, faces[t].b[1] = {1, 0}, faces[t].b[2] = {0, 1};
    for (int k = 0; k < 3; ++k) {
      faces[t].weld[k] = weld[3 * size_t{t} + static_cast<size_t>(k)];
      next_weld = std::max(next_weld, faces[t].weld[k] + 1);
    }
  }
  Evaluation evaluate(display, source, search, split);
  for (uint32_t pass = 0;; ++pass) {
    for (DisplayFace& f : faces)
      if (f.is_new) evaluate(f);
    std::set<Side> marked;
    for (const DisplayFace& f : faces)
      for (int k = 0; k < 3; ++k)
        if (f.wants[k]) marked.insert(side_of(f, k));
    if (marked.empty() || pass == kMaxPasses || faces.size() > most_faces(mesh.triangles.size()))
      return faces;
    Splitter splitter(marked, next_weld);
    std::vector<DisplayFace> finer;
    for (const DisplayFace& f : faces) splitter.split(f, finer);
    faces = std::move(finer);
  }
}

}  // namespace kiln
