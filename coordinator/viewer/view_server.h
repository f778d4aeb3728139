// ROOM: a bake's folder in a browser. HTTP on loopback, GET and HEAD, files only:
//   /bake/...                the folder
//   /docs/examples/three/... the viewer, and three.js in its node_modules
//   /docs/shaders/...        the GLSL that the viewer includes
#pragma once

#include <filesystem>
#include <memory>

#include "common/base/status.h"

namespace kiln {

struct ViewSettings {
  std::filesystem::path bake;   // written by kiln bake
  std::filesystem::path share;  // holds examples/three and shaders
  uint16_t port = 0;            // 0: any free port
};

// Checks that everything a viewer needs is there. Errors (kInvalidInput): no folder, no scene.glb
// in it, no viewer, no three.js; each says what to do.
Status check_view(const ViewSettings& settings);

// The folder with the viewer's files: $KILN_SHARE, share/kiln beside the program's folder, or the
// checkout's docs.
std::filesystem::path find_share();

class ViewServer {
 public:
  // Listens on 127.0.0.1 and returns; its threads serve requests until it is destroyed.
  static Expected<std::unique_ptr<ViewServer>> start(const ViewSettings& settings);
  ~ViewServer();
  uint16_t port() const;

 private:
  struct Impl;
  explicit ViewServer(std::unique_ptr<Impl> impl);
  std::unique_ptr<Impl> impl_;
};

}  // namespace kiln
