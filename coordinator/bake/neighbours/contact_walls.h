// Does the way between two places on a surface pass a line where something stands on it?
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

  // Seen along `normal`, which both places share: do the segment a b and a contact of that side cross?
  // Contacts further than `gap` off the surface are of another one.
  bool between(const DVec3& a, const DVec3& b, const DVec3& normal, double gap) const;
  bool empty() const { return lines_.empty(); }

 private:
  std::vector<BorderEdge> lines_;
  EdgeTree tree_;  // over lines_
};

}  // namespace kiln
