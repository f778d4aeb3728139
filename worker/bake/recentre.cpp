#include "worker/bake/recentre.h"

#include <optional>

namespace kiln {
namespace {

struct Box {
  Vec3 low{0.0f}, high{-1.0f};  // empty
};
struct Stretch {
  double low = 0, high = -1;
};

std::vector<Box> mesh_boxes(const Scene& scene) {
  std::vector<Box> boxes;
  for (const Mesh& m : scene.meshes) {
    Box box;
    if (!m.positions.empty()) box = {m.positions[0], m.positions[0]};
    for (const Vec3& p : m.positions) box.low = glm::min(box.low, p), box.high = glm::max(box.high, p);
    boxes.push_back(box);
  }
  return boxes;
}

// Contains the boxes of all instances; not tight for rotated ones.
Stretch stretch_of(const Scene& scene, const std::vector<Box>& boxes, int axis) {
  Stretch s;
  for (const Instance& i : scene.instances) {
    const Box& box = boxes[i.mesh];
    if (box.high.x < box.low.x) continue;
    double low = i.to_world[3][axis], high = low;
    for (int k = 0; k < 3; ++k) {
      const double scale = i.to_world[k][axis], one = scale * box.low[k], other = scale * box.high[k];
      low += std::min(one, other);
      high += std::max(one, other);
    }
    const bool first = s.high < s.low;
    s.low = first ? low : std::min(s.low, low);
    s.high = first ? high : std::max(s.high, high);
  }
  return s;
}

// The middle of a far stretch, with as many bits as coordinates have there.
std::optional<float> far_middle(const Stretch& s) {
  const bool far = (s.low > 0 && s.high <= 2 * s.low) || (s.high < 0 && s.low >= 2 * s.high);
  if (!far) return std::nullopt;
  return static_cast<float>((s.low + s.high) / 2);
}

// Whether x - c is exact. The rounding error of a difference is a float (Knuth 1969, TAOCP 2, 4.2.2).
bool exact(float x, float c) {
  const float difference = x - c, minus_c = difference - x;
  return (x - (difference - minus_c)) - (c + minus_c) == 0.0f;
}

// Whether the mesh axis maps straight onto the world axis.
bool is_plain(const Mat4x3& m, int axis) {
  for (int k = 0; k < 3; ++k)
    if (m[k][axis] != (k == axis ? 1.0f : 0.0f)) return false;
  return m[3][axis] == 0.0f;
}

bool placed(const Record& light) {
  return light.type != "directional" && light.type != "environment";
}

// Moves instances by their transforms or, if these leave the axis unchanged, by their meshes' vertices.
bool move(Scene& scene, int axis, float c) {
  std::vector<char> by_vertices(scene.meshes.size(), 0);
  for (const Instance& i : scene.instances)
    if (is_plain(i.to_world, axis)) by_vertices[i.mesh] = 1;
  for (const Instance& i : scene.instances)
    if (by_vertices[i.mesh] ? !is_plain(i.to_world, axis) : !exact(i.to_world[3][axis], c)) return false;
  for (size_t m = 0; m < scene.meshes.size(); ++m)
    for (const Vec3& p : scene.meshes[m].positions)
      if (by_vertices[m] && !exact(p[axis], c)) return false;
  for (const Record& light : scene.lights)
    if (placed(light) && !exact(light.to_world[3][axis], c)) return false;

  for (Instance& i : scene.instances)
    if (!by_vertices[i.mesh]) i.to_world[3][axis] -= c;
  for (size_t m = 0; m < scene.meshes.size(); ++m)
    if (by_vertices[m])
      for (Vec3& p : scene.meshes[m].positions) p[axis] -= c;
  for (Record& light : scene.lights)
    if (placed(light)) light.to_world[3][axis] -= c;
  return true;
}

}  // namespace

Vec3 recentre(Scene& scene) {
  const std::vector<Box> boxes = mesh_boxes(scene);
  Vec3 moved(0.0f);
  for (int axis = 0; axis < 3; ++axis)
    if (const auto c = far_middle(stretch_of(scene, boxes, axis)); c && move(scene, axis, *c))
      moved[axis] = *c;
  return moved;
}

}  // namespace kiln
