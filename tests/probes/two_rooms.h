// The leak of light through a wall: two rooms, one whose walls shine and one that is dark.
#pragma once

#include "common/probes/query.h"
#include "coordinator/scene/probes/probes.h"

namespace kiln::test {

// Rooms of 4 x 3 x 8 m beside each other along x, `wall` metres apart; surfaces of the first emit 1, and both
// reflect half. Its E is 2 pi, that of the second 0.
Scene two_rooms(float wall);

struct Leak {
  double mean = 0, p99 = 0;  // of E in the dark room, as a share of E in the lit one
};

// At `points` places on the wall, the floor and the ceiling of the dark room, for each of `offsets` places of
// a grid of that spacing. `samples`: of each probe and replicate.
Leak leak_of(float wall, double spacing, int offsets, int points, uint32_t samples, const ProbeQuery& query,
             bool keep_inside = false);

}  // namespace kiln::test
