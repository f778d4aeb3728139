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
  bool given_up = false;  // too many triangles are near each other: there are no contacts
};

// A floor with a million things on it has millions of pairs of near triangles; a hundred times more is one
// place filled with copies or with chaos. Besides, any scene may have so many for each of its triangles.
constexpr uint64_t kMaxPairs = uint64_t{1} << 28, kPairsOfTriangle = 128;
constexpr uint64_t kMaxContacts = uint64_t{1} << 21, kContactsOfTriangle = 16;

class ContactFinder {
 public:
  // `texel` is the size of a texel of each instance in metres; it and the scene outlive the finder.
  ContactFinder(const Scene& scene, std::span<const double> texel, unsigned threads);
  ~ContactFinder();

  // Finds the contacts of all instances. Triangles that lie on each other corner by corner make one contact.
  // Surfaces that rise less than kContactRise texels, hover more than kContactGap texels above the surface,
  // touch it over less than kContactReach texels in all (the foot of a chair) or let light through make no
  // contact. The result does not depend on the number of threads. `is_stopped` may be called from any thread;
  // once it returns true the search stops and the result is incomplete. Given up beyond `max_pairs` pairs of
  // near triangles and kPairsOfTriangle for each triangle.
  Contacts find(const std::function<bool()>& is_stopped = {}, uint64_t max_pairs = kMaxPairs) const;

  // Whether a ray upwards from just above a point of an instance's triangle hits a back face first.
  bool is_buried(uint32_t instance, uint32_t triangle, const DVec2& barycentrics) const;

 private:
  class Search;
  std::unique_ptr<Search> search_;
};
constexpr double kContactGap = 0.02, kContactRise = 0.04, kContactReach = 2;

// Cuts the charts of one instance along its contacts: triangles are split where a contact crosses them, and
// the parts on either side of a contact go to different charts. `base`: the charts of its mesh. If nothing is
// cut, the result has no faces. Surface hidden below the standing object (`is_buried` of triangle and
// barycentrics) gets no texels: its faces shrink to a point of a neighbour. `refused`: triangles with more
// contacts than kMaxParts allows, left whole.
constexpr size_t kMaxParts = 256;
MeshCharts cut_charts(const Mesh& mesh, const Mat4x3& to_world, const MeshCharts& base,
                      std::span<const Contact> contacts, double texel,
                      const std::function<bool(uint32_t, const DVec2&)>& is_buried, size_t& refused);

}  // namespace kiln
