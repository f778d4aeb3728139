// Chooses the camera of pictures.
#pragma once

#include <string>

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/scene/import/import.h"

namespace kiln {

// The camera that --camera asks for: a camera of the file by name, or "X,Y,Z:X,Y,Z[:FOV]" (position, target,
// vertical degrees). By default the first camera of the file that shows something, otherwise one chosen by
// what it shows: many kinds of objects, surfaces and distances, light and shadow, few back faces. The search
// traces rays in the coordinator; its result does not depend on the number of threads. Errors (kUsage): an
// unknown camera name, with a list of those that exist; invalid coordinates.
Expected<Camera> preview_camera(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                                const std::string& wish = "");

// Checks without rays whether preview_camera would refuse --camera.
Status check_camera(const ImportResult& imported, const std::string& wish);

// The camera chosen by search, whatever cameras the file has.
Camera choose_camera(const ImportResult& imported, const Atlas& atlas, const Lightmap& map);

// At `eye`, looking along `forward`, upright.
Camera look_along(const Vec3& eye, const Vec3& forward, float vertical_fov, std::string name);

}  // namespace kiln
