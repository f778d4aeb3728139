#include "tests/import/gltf_builder.h"
