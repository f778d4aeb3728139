# Third-party libraries, all from Debian's packages. Each is included by one named file of ours
# (docs/architecture.md lists which), so replacing one is a change to one room.
find_package(Threads REQUIRED)
find_package(OpenSSL REQUIRED COMPONENTS Crypto SSL)

function(kiln_require_header variable header package)
  find_path(${variable} ${header})
  if(NOT ${variable})
    message(FATAL_ERROR "${header} not found: install the Debian package ${package} (./kiln does this)")
  endif()
endfunction()
function(kiln_require_library variable name package)
  find_library(${variable} ${name})
  if(NOT ${variable})
    message(FATAL_ERROR "lib${name} not found: install the Debian package ${package} (./kiln does this)")
  endif()
endfunction()

kiln_require_header(KILN_EXPECTED_INCLUDE tl/expected.hpp libexpected-dev)
kiln_require_header(KILN_GLM_INCLUDE glm/vec3.hpp libglm-dev)
kiln_require_header(KILN_ASIO_INCLUDE asio.hpp libasio-dev)
kiln_require_header(KILN_TINYGLTF_INCLUDE tiny_gltf.h libtinygltf-dev)
kiln_require_header(KILN_CLI11_INCLUDE CLI/CLI.hpp libcli11-dev)
kiln_require_header(KILN_JSON_INCLUDE nlohmann/json.hpp nlohmann-json3-dev)
kiln_require_header(KILN_SQLITE_INCLUDE sqlite3.h libsqlite3-dev)
kiln_require_library(KILN_SQLITE sqlite3 libsqlite3-dev)
kiln_require_library(KILN_XXHASH xxhash libxxhash-dev)
kiln_require_library(KILN_ZSTD zstd libzstd-dev)
kiln_require_library(KILN_FMT fmt libfmt-dev)
kiln_require_library(KILN_SPDLOG spdlog libspdlog-dev)
kiln_require_library(KILN_OIIO OpenImageIO libopenimageio-dev)
kiln_require_library(KILN_OIIO_UTIL OpenImageIO_Util libopenimageio-dev)

# Embree 3 is what Debian 12 ships; worker/accel/embree_api.h also speaks Embree 4.
find_library(KILN_EMBREE NAMES embree4 embree3)
if(NOT KILN_EMBREE)
  message(FATAL_ERROR "Embree not found: install the Debian package libembree-dev (./kiln does this)")
endif()

find_package(OpenEXR CONFIG REQUIRED)

find_program(KILN_FLATC flatc)
kiln_require_header(KILN_FLATBUFFERS_INCLUDE flatbuffers/flatbuffers.h libflatbuffers-dev)
if(NOT KILN_FLATC)
  message(FATAL_ERROR "flatc not found: install the Debian package flatbuffers-compiler (./kiln does this)")
endif()

kiln_require_header(KILN_EIGEN_INCLUDE eigen3/Eigen/Sparse libeigen3-dev)
