#include "tests/viewer/node_tools.h"

namespace kiln::test {
namespace fs = std::filesystem;

std::optional<std::string> left_out(const std::string& group) {
  const char* groups = ::getenv("KILN_TEST_WITHOUT");
  if (groups == nullptr || (" " + std::string(groups) + " ").find(" " + group + " ") == std::string::npos)
    return std::nullopt;
  return "left out: --without " + group;
}

std::optional<std::string> no_node_tools(bool browser) {
  if (auto why = left_out("web")) return why;
  if (run_command("node --version").exit_status != 0) return "there is no node: apt install nodejs npm";
  const fs::path tools = source_dir() / "tests/node", viewer = source_dir() / "docs/examples/three";
  if (!fs::exists(tools / "node_modules/gltf-validator")) return "run: npm ci --prefix " + tools.string();
  if (!browser) return std::nullopt;
  if (!fs::exists(viewer / "node_modules/three")) return "run: npm ci --prefix " + viewer.string();
  if (!fs::exists("/usr/bin/chromium")) return "there is no /usr/bin/chromium: apt install chromium";
  return std::nullopt;
}

std::optional<std::string> no_engines() {
  if (auto why = no_node_tools(true)) return why;
  const fs::path engines = source_dir() / "tests/node/engines";
  for (const char* module : {"three", "babylonjs", "babylonjs-loaders", "playcanvas"})
    if (!fs::exists(engines / "node_modules" / module)) return "run: npm ci --prefix " + engines.string();
  return std::nullopt;
}

std::string node_script(const std::string& name) {
  return "node '" + (source_dir() / "tests/node" / name).string() + "'";
}

}  // namespace kiln::test
