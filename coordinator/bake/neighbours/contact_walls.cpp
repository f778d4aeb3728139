#include "coordinator/bake/neighbours/contact_walls.h"

namespace kiln {
namespace {

std::vector<BorderEdge> as_edges(std::span<const ContactLine> contacts) {
  std::vector<BorderEdge> lines(contacts.size());
  for (size_t i = 0; i < lines.size(); ++i) {
    lines[i].p[0] = DVec3(contacts[i].a), lines[i].p[1] = DVec3(contacts[i].b);
    lines[i].normal[0] = contacts[i].normal;
  }
  return lines;
}

// Twice the signed area of a, b, c projected along `normal`.
double side(const DVec3& a, const DVec3& b, const DVec3& c, const DVec3& normal) {
  return dot(cross(b - a, c - a), normal);
}

}  // namespace

ContactWalls::ContactWalls(std::span<const ContactLine> contacts)
    : lines_(as_edges(contacts)), tree_(lines_) {}

bool ContactWalls::between(const DVec3& a, const DVec3& b, const DVec3& normal, double gap) const {
  bool found = false;
  tree_.for_each_near(a, b, gap, [&](uint32_t i) {
    const BorderEdge& line = lines_[i];
    if (dot(DVec3(line.normal[0]), normal) <= 0.5) return true;
    const double pa = side(line.p[0], line.p[1], a, normal), pb = side(line.p[0], line.p[1], b, normal);
    const double la = side(a, b, line.p[0], normal), lb = side(a, b, line.p[1], normal);
    if (!(pa * pb < 0 && la * lb <= 0)) return true;
    const DVec3 at = line.p[0] + (line.p[1] - line.p[0]) * (la / (la - lb));
    found = std::abs(dot(at - a, normal)) <= gap;
    return !found;
  });
  return found;
}

bool ContactWalls::may_be_near(const DVec3& a, const DVec3& b, double distance) const {
  bool any = false;
  tree_.for_each_near(a, b, distance, [&](uint32_t) {
    any = true;
    return false;
  });
  return any;
}

}  // namespace kiln
