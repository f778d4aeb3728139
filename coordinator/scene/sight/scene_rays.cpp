#include "coordinator/scene/sight/scene_rays.h"

#include <array>
#include <numeric>

#include "common/base/parallel.h"

namespace kiln {
namespace {

constexpr int kBins = 12;
constexpr int kBinnedDepth = 60;  // see SceneRays::kStack

float half_area(const BoxNode& b) {
  const Vec3 d = glm::max(b.high - b.low, Vec3(0.0f));
  return d.x * d.y + d.y * d.z + d.z * d.x;
}
void join(BoxNode& into, const BoxNode& b) {
  into.low = glm::min(into.low, b.low);
  into.high = glm::max(into.high, b.high);
}

// Splits by the surface area heuristic (Wald 2007, binned).
class Builder {
 public:
  Builder(std::vector<BoxNode> boxes, uint32_t leaf) : boxes_(std::move(boxes)), leaf_(leaf) {
    order_.resize(boxes_.size());
    std::iota(order_.begin(), order_.end(), 0u);
    for (const BoxNode& b : boxes_) middle_.push_back(0.5f * (b.low + b.high));
  }

  std::vector<BoxNode> build() {
    if (boxes_.empty()) return {};
    nodes_.reserve(2 * boxes_.size() / leaf_ + 2);
    nodes_.push_back(box_of(0, static_cast<uint32_t>(boxes_.size())));
    std::vector<std::pair<uint32_t, int>> open{{0, 0}};
    while (!open.empty()) {
      const auto [at, depth] = open.back();
      open.pop_back();
      if (nodes_[at].count <= leaf_) continue;
      const uint32_t begin = nodes_[at].first, end = begin + nodes_[at].count;
      const uint32_t middle = split(begin, end, depth);
      const auto children = static_cast<uint32_t>(nodes_.size());
      nodes_[at].first = children;
      nodes_[at].count = 0;
      nodes_.push_back(box_of(begin, middle));
      nodes_.push_back(box_of(middle, end));
      open.push_back({children + 1, depth + 1});
      open.push_back({children, depth + 1});
    }
    return std::move(nodes_);
  }
  const std::vector<uint32_t>& order() const { return order_; }

 private:
  BoxNode box_of(uint32_t begin, uint32_t end) const {
    BoxNode b;
    for (uint32_t i = begin; i < end; ++i) join(b, boxes_[order_[i]]);
    b.first = begin;
    b.count = end - begin;
    return b;
  }

  uint32_t split(uint32_t begin, uint32_t end, int depth) {
    BoxNode middles;
    for (uint32_t i = begin; i < end; ++i) middles.add(middle_[order_[i]]);
    const Vec3 extent = middles.high - middles.low;
    const int axis = extent.x >= extent.y && extent.x >= extent.z ? 0 : extent.y >= extent.z ? 1 : 2;
    if (depth < kBinnedDepth && extent[axis] > 0)
      if (const uint32_t at = binned(begin, end, axis, middles.low[axis], extent[axis]); at) return at;
    const uint32_t half = begin + (end - begin) / 2;
    std::nth_element(
        order_.begin() + begin, order_.begin() + half, order_.begin() + end, [&](uint32_t a, uint32_t b) {
          return middle_[a][axis] != middle_[b][axis] ? middle_[a][axis] < middle_[b][axis] : a < b;
        });
    return half;
  }

  // 0: one side would be empty.
  uint32_t binned(uint32_t begin, uint32_t end, int axis, float low, float extent) {
    const float scale = kBins * 0.9999f / extent;
    const auto bin_of = [&](uint32_t i) {
      return std::clamp(static_cast<int>((middle_[i][axis] - low) * scale), 0, kBins - 1);
    };
    std::array<BoxNode, kBins> bins;
    for (uint32_t i = begin; i < end; ++i) {
      BoxNode& bin = bins[static_cast<size_t>(bin_of(order_[i]))];
      join(bin, boxes_[order_[i]]);
      ++bin.count;
    }
    std::array<float, kBins> right{};
    BoxNode all;
    for (int k = kBins - 1; k > 0; --k) {
      join(all, bins[static_cast<size_t>(k)]);
      all.count += bins[static_cast<size_t>(k)].count;
      right[static_cast<size_t>(k)] = half_area(all) * static_cast<float>(all.count);
    }
    int best = 0;
    float least = std::numeric_limits<float>::infinity();
    all = {};
    for (int k = 1; k < kBins; ++k) {
      join(all, bins[static_cast<size_t>(k - 1)]);
      all.count += bins[static_cast<size_t>(k - 1)].count;
      const float cost = half_area(all) * static_cast<float>(all.count) + right[static_cast<size_t>(k)];
      if (all.count > 0 && all.count < end - begin && cost < least) least = cost, best = k;
    }
    if (!best) return 0;
    const auto middle = std::stable_partition(order_.begin() + begin, order_.begin() + end,
                                              [&](uint32_t i) { return bin_of(i) < best; });
    return static_cast<uint32_t>(middle - order_.begin());
  }

  std::vector<BoxNode> boxes_, nodes_;
  std::vector<Vec3> middle_;
  std::vector<uint32_t> order_;
  const uint32_t leaf_;
};

}  // namespace

SceneRays::MeshTree SceneRays::tree_of(const Mesh& mesh) {
  std::vector<BoxNode> boxes(mesh.triangles.size());
  for (size_t t = 0; t < boxes.size(); ++t)
    for (int k = 0; k < 3; ++k) boxes[t].add(mesh.positions[mesh.triangles[t][k]]);
  Builder builder(std::move(boxes), 4);
  MeshTree tree;
  tree.nodes = builder.build();
  tree.triangles.reserve(mesh.triangles.size());
  for (const uint32_t t : builder.order()) {
    const UVec3& v = mesh.triangles[t];
    const Vec3& a = mesh.positions[v.x];
    tree.triangles.push_back({a, mesh.positions[v.y] - a, mesh.positions[v.z] - a, t});
  }
  return tree;
}

SceneRays::SceneRays(const Scene& scene, unsigned threads) : scene_(scene), meshes_(scene.meshes.size()) {
  parallel_for(
      meshes_.size(), [&](size_t m) { meshes_[m] = tree_of(scene.meshes[m]); }, threads);
  std::vector<BoxNode> boxes(scene.instances.size());
  for (size_t i = 0; i < boxes.size(); ++i) {
    const Instance& instance = scene.instances[i];
    if (meshes_[instance.mesh].nodes.empty()) continue;
    const BoxNode& box = meshes_[instance.mesh].nodes[0];
    for (int k = 0; k < 8; ++k)
      boxes[i].add(transform_point(
          instance.to_world,
          {k & 1 ? box.high.x : box.low.x, k & 2 ? box.high.y : box.low.y, k & 4 ? box.high.z : box.low.z}));
  }
  Builder builder(std::move(boxes), 1);
  top_ = builder.build();
  for (const uint32_t i : builder.order()) {
    const Mat4x3& m = scene.instances[i].to_world;
    const float det = determinant(m);
    const Vec3 x = cross(m[1], m[2]) / det, y = cross(m[2], m[0]) / det, z = cross(m[0], m[1]) / det;
    Place place{i, Mat4x3({x.x, y.x, z.x}, {x.y, y.y, z.y}, {x.z, y.z, z.z}, Vec3(0.0f))};
    place.to_mesh[3] = -transform_vector(place.to_mesh, m[3]);
    places_.push_back(place);
  }
}

}  // namespace kiln
