#include "tests/viewer/programs.h"

#include <nlohmann/json.hpp>
#include <regex>

#include "common/base/files.h"
#include "tests/viewer/node_tools.h"

namespace kiln::test {
namespace fs = std::filesystem;

namespace {

std::string text_of(const fs::path& file) {
  const auto bytes = read_file(file);
  EXPECT_TRUE(bytes) << file;
  return bytes ? std::string(reinterpret_cast<const char*>(bytes->data()), bytes->size()) : "";
}

std::string blender_script(const std::string& script) {
  return "blender -b --factory-startup --python-exit-code 1 --python '" + (source_dir() / script).string() +
         "' -- ";
}

std::string quoted(const fs::path& path) {
  return " '" + path.string() + "'";
}

// The first number of the output, with its points: "3.2.3" of "3.2.3.stable".
std::string version_in(const std::string& command) {
  const std::string said = run_command(command).output;
  std::smatch found;
  return std::regex_search(said, found, std::regex("[0-9]+([.][0-9]+)*")) ? found.str() : "";
}

}  // namespace

Expected<Published> bake_for_programs(const fs::path& scene, double texels_per_metre, const fs::path& folder,
                                      uint32_t samples) {
  BakeRequest request;
  request.scene = scene;
  request.output = folder;
  request.worker_program = binary_dir() / "bin/kiln-worker";
  request.settings.layout = "pack";
  request.settings.texels_per_metre = texels_per_metre;
  request.settings.min_samples = request.settings.max_samples = samples;
  // As configs/engines/babylon.json, playcanvas.json and godot.json.
  request.settings.encodings = {"rgbd", "rgbm", "exr"};
  request.settings.encode_quantity = "irradiance";
  request.settings.encode_units = "e-over-pi";
  KILN_TRY([[maybe_unused]] const auto report, run_bake(request, [](const BakeProgress&) {}));
  return read_published(request.scene, request.settings, folder);
}

std::optional<std::string> no_blender() {
  if (auto why = left_out("blender")) return why;
  if (run_command("blender --version").exit_status == 0) return std::nullopt;
  return "there is no Blender: apt install blender";
}

std::optional<std::string> no_godot() {
  if (auto why = left_out("godot")) return why;
  for (const char* program : {"godot3", "godot3-runner", "xvfb-run"})
    if (run_command(std::string("command -v ") + program).exit_status != 0)
      return std::string("there is no ") + program + ": apt install godot3 godot3-runner xvfb";
  return std::nullopt;
}

std::string version_of_engine(const std::string& engine) {
  const std::string package = engine == "babylon" ? "babylonjs" : engine;
  const fs::path file = source_dir() / "tests/node/engines/node_modules" / package / "package.json";
  return nlohmann::json::parse(text_of(file)).at("version");
}

std::string version_of_blender() {
  return version_in("blender --version");
}

std::string version_of_godot() {
  return version_in("godot3-runner --version");
}

CommandResult show_in_engine(const std::string& engine, const fs::path& folder, const std::string& file,
                             const fs::path& shot, const std::string& exposure, const std::string& material) {
  return run_command(node_script("engines/engine_shot.mjs") + " " + engine + quoted(folder) + " " + file +
                     " " + std::to_string(kSampledWidth) + " " + std::to_string(kSampledHeight) +
                     quoted(shot) + " '" + exposure + "' " + material);
}

CommandResult show_in_blender(const fs::path& file, const fs::path& shot) {
  return run_command(blender_script("tests/node/engines/blender_shot.py") + quoted(file) + quoted(shot));
}

CommandResult show_in_add_on(const fs::path& scene, const fs::path& folder, const fs::path& shot) {
  return run_command(blender_script("tests/blender/lit_shot.py") + quoted(scene) + quoted(folder) +
                     quoted(shot));
}

CommandResult show_in_godot(const fs::path& folder, const std::string& driver, const fs::path& work,
                            const fs::path& shot) {
  const fs::path project = work / driver, files = source_dir() / "tests/godot";
  fs::create_directories(project / "out");
  fs::copy(source_dir() / "configs/engines/godot/addons", project / "addons", fs::copy_options::recursive);
  for (const char* name : {"main.gd", "main.tscn"}) fs::copy(files / name, project / name);
  fs::copy(files / "scene.glb.import", project / "out/scene.glb.import");
  for (const char* name : {"scene.glb", "lightmap_E.exr"}) fs::copy(folder / name, project / "out" / name);
  std::string settings = text_of(files / "project.godot.in");
  settings.replace(settings.find("@DRIVER@"), 8, driver);
  EXPECT_TRUE(write_file_atomic(project / "project.godot", settings));
  // The editor of 3.2 may crash when it quits, after it has imported: what it leaves decides.
  const std::string xvfb = "timeout 240 xvfb-run -a -s '-screen 0 1280x1024x24' ",
                    path = " --path" + quoted(project);
  const auto import = run_command(xvfb + "godot3" + path + " --editor --quit --video-driver GLES3");
  auto run = run_command("KILN_SHOT=" + quoted(shot).substr(1) + " " + xvfb + "godot3-runner" + path +
                         " --video-driver " + driver);
  run.exit_status = fs::exists(shot) ? 0 : 1;
  run.output = import.output + run.output;
  return run;
}

}  // namespace kiln::test
