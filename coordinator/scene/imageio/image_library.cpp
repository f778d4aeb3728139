#include "coordinator/scene/imageio/image_library.h"

#include <dlfcn.h>

#include <filesystem>

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr const char* kModule = "kiln-images.so";

// Beside the program in a build tree, else where it is installed.
Expected<const ImageLibrary*> load() {
  std::error_code ignored;
  const std::filesystem::path folder = std::filesystem::read_symlink("/proc/self/exe", ignored).parent_path();
  std::string why;
  for (const std::filesystem::path& path :
       {folder / kModule, folder.parent_path() / "lib" / "kiln" / kModule}) {
    if (void* module = dlopen(path.c_str(), RTLD_LAZY | RTLD_LOCAL)) {
      using Get = const ImageLibrary* (*)();
      if (const auto get = reinterpret_cast<Get>(dlsym(module, "kiln_image_library"))) return get();
    }
    if (const char* error = dlerror()) why += (why.empty() ? "" : "; ") + std::string(error);
  }
  return fail(ErrorKind::kInternal,
              text("cannot load {}, Kiln's part that reads and writes images: {}. Install "
                   "Kiln again, or copy that file to where the program is",
                   kModule, why));
}

}  // namespace

Expected<const ImageLibrary*> image_library() {
  static const Expected<const ImageLibrary*> kLibrary = load();
  return kLibrary;
}

}  // namespace kiln
