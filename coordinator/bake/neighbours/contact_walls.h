// Tests whether the path between two points of a surface crosses a contact line.
#pragma once

#include <span>

#include "common/contacts/contacts.h"
#include "coordinator/bake/seams/edge_tree.h"

namespace kiln {

class ContactWalls {
 public:
  explicit ContactWalls(std::span<const ContactLine> contacts);
  ContactWalls(const ContactWalls&) = delete;
  ContactWalls& operator=(const ContactWalls&) = delete;

  // Projected along `normal`, which both points share: whether the segment a b crosses a contact on that
  // side. Contacts more than `gap` off the surface belong to another surface.
  bool between(const DVec3& a, const DVec3& b, const DVec3& normal, double gap) const;
  // Whether a contact may lie within `distance` of the segment a b: false is certain.
  bool may_be_near(const DVec3& a, const DVec3& b, double distance) const;
  bool empty() const { return lines_.empty(); }

 private:
  std::vector<BorderEdge> lines_;
  EdgeTree tree_;  // over lines_
};

}  // namespace kiln
