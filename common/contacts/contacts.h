// Where surfaces stand on or run through others: a wall on a floor, a shelf on a wall. A texel of the floor
// that reaches under a thin wall would hold light of both sides; charts are cut along these lines.
#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "common/scene/scene.h"
#include "common/unwrap/mesh_charts.h"

namespace kiln {

// A line on a triangle, along which another surface rises from its front.
struct Contact {
  uint32_t triangle;  // of the mesh of the instance
  DVec2 a, b;         // barycentrics (b1, b2) of its ends, within the triangle
};

// The same in the world.
struct ContactLine {
  Vec3 a, b;
  Vec3 normal;  // unit, of the surface that is stood on
};

struct Contacts {
  std::vector<std::vector<Contact>> of_instance;
  std::vector<ContactLine> lines;
};

class ContactFinder {
 public:
  // `texel` is the size of a texel of each instance in metres; it and the scene outlive the finder.
  ContactFinder(const Scene& scene, std::span<const double> texel, unsigned threads);
  ~ContactFinder();

  // Contacts of all instances. What rises less than kContactRise texels, hovers more than kContactGap of one
  // above the surface, or whose contact as a whole reaches less than kContactReach texels (the foot of a
  // chair) is no contact; nor is a surface that lets light through. The same scene gives the same contacts
  // whatever the number of threads. `is_stopped` is asked from any thread; once it says yes the search ends,
  // and the result is incomplete.
  Contacts find(const std::function<bool()>& is_stopped = {}) const;

  // Does a ray upwards from just above a point of an instance's triangle meet the inner side of something?
  bool is_buried(uint32_t instance, uint32_t triangle, const DVec2& barycentrics) const;

 private:
  class Search;
  std::unique_ptr<Search> search_;
};
constexpr double kContactGap = 0.02, kContactRise = 0.04, kContactReach = 2;

// The charts of one instance cut along its contacts: triangles are parted where a contact crosses them, and
// parts on the two sides of a contact are in different charts. `base` are the charts of its mesh. Nothing is
// cut: the result has no faces. What nobody sees below what stands there (`is_buried` of triangle and
// barycentrics) gets no texels: its faces shrink to a point of a neighbour. `refused`: triangles with more
// contacts than kMaxParts allows, left whole.
constexpr size_t kMaxParts = 256;
MeshCharts cut_charts(const Mesh& mesh, const Mat4x3& to_world, const MeshCharts& base,
                      std::span<const Contact> contacts, double texel,
                      const std::function<bool(uint32_t, const DVec2&)>& is_buried, size_t& refused);

}  // namespace kiln
