// What a user sees for every bad input: one clear message naming the file and the element, the exit status,
// and nothing half-written. The table of docs/testing.md is made here: KILN_WRITE_DOCS=1 rewrites it, and
// the last test holds the page against what the program says.
#include <sys/mount.h>

#include <algorithm>
#include <fstream>
#include <functional>
#include <map>
#include <regex>
#include <sstream>

#include "common/base/files.h"
#include "coordinator/scene/document/gltf_document.h"
#include "coordinator/scene/imageio/exr.h"

namespace kiln {
namespace {
namespace fs = std::filesystem;

void replace(std::string& text, const std::string& from, const std::string& to) {
  const size_t at = text.find(from);
  ASSERT_NE(at, std::string::npos) << from;
  text.replace(at, from.size(), to);
}

// A lit square metre in two triangles, whose parts a case may spoil before it is written.
struct SmallScene {
  std::vector<float> positions = {0, 0, 0, 0, 0, 1, 1, 0, 1, 1, 0, 0};
  std::vector<float> uv = {0.1f, 0.1f, 0.1f, 0.9f, 0.9f, 0.9f, 0.9f, 0.1f};
  std::vector<uint16_t> indices = {0, 1, 2, 0, 2, 3};
  std::string json = R"({"asset":{"version":"2.0"},"extensionsUsed":["KHR_lights_punctual"],
"scene":0,"scenes":[{"nodes":[0,1]}],
"nodes":[{"name":"floor","mesh":0},{"name":"lamp","translation":[0.5,1,0.5],"extensions":{"KHR_lights_punctual":{"light":0}}}],
"meshes":[{"name":"square","primitives":[{"attributes":{"POSITION":0,"TEXCOORD_1":1},"indices":2,"material":0}]}],
"materials":[{"name":"grey","doubleSided":true,"pbrMetallicRoughness":{"baseColorFactor":[0.5,0.5,0.5,1]}}],
"accessors":[{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3"},
{"bufferView":1,"componentType":5126,"count":4,"type":"VEC2"},
{"bufferView":2,"componentType":5123,"count":6,"type":"SCALAR"}],
"bufferViews":[{"buffer":0,"byteOffset":0,"byteLength":48},{"buffer":0,"byteOffset":48,"byteLength":32},
{"buffer":0,"byteOffset":80,"byteLength":12}],
"buffers":[{"uri":"x.bin","byteLength":92}],
"extensions":{"KHR_lights_punctual":{"lights":[{"type":"point","intensity":5}]}}})";

  Bytes buffer() const {
    Bytes b;
    for (const auto part : {bytes_of(positions), bytes_of(uv), bytes_of(indices)})
      b.insert(b.end(), part.begin(), part.end());
    return b;
  }
  void write(const fs::path& folder) const {
    ASSERT_TRUE(write_file_atomic(folder / "x.gltf", json));
    ASSERT_TRUE(write_file_atomic(folder / "x.bin", buffer()));
  }
  Bytes glb() const {
    std::string inner = json;
    replace(inner, R"("uri":"x.bin",)", "");
    return write_glb(inner, buffer());
  }
};

struct Case {
  std::string name;
  int status;                             // of the program
  std::vector<std::string> must_contain;  // of the message
  std::function<std::string(const fs::path&)>
      make;  // writes the input, returns the arguments after `kiln bake`
};

void write_environment(const fs::path& path, float bad) {
  std::vector<float> plane(8 * 4, 1.0f);
  std::vector<float> broken = plane;
  broken[8 * 2 + 5] = bad;
  const ExrChannel channels[] = {{"R", plane.data()}, {"G", broken.data()}, {"B", plane.data()}};
  ASSERT_TRUE(write_exr(path, 8, 4, channels));
}

std::string spoiled(const fs::path& dir, const std::function<void(SmallScene&)>& spoil,
                    const std::string& options = "") {
  SmallScene s;
  spoil(s);
  s.write(dir);
  return std::string("x.gltf -o out --max-samples 64 ") +
         (options.find("--resolution") == options.npos ? "--resolution 32 " : "") + options;
}

std::vector<Case> cases() {
  const float nan = std::nanf(""), inf = INFINITY;
  std::vector<Case> all;
  const auto add = [&](std::string name, int status, std::vector<std::string> contain,
                       std::function<std::string(const fs::path&)> make) {
    all.push_back({std::move(name), status, std::move(contain), std::move(make)});
  };
  add("no such file", 2, {"nothing.glb"}, [](const fs::path&) { return "nothing.glb -o out"; });
  add("truncated .glb", 2, {"x.glb", "truncated"}, [](const fs::path& dir) {
    Bytes b = SmallScene().glb();
    b.resize(b.size() / 2);
    EXPECT_TRUE(write_file_atomic(dir / "x.glb", b));
    return "x.glb -o out";
  });
  add("corrupt .glb", 2, {"x.glb", "JSON"}, [](const fs::path& dir) {
    Bytes b = SmallScene().glb();
    for (int i = 40; i < 60; ++i) b[i] = std::byte{0xff};
    EXPECT_TRUE(write_file_atomic(dir / "x.glb", b));
    return "x.glb -o out";
  });
  add("missing .bin", 2, {"x.gltf", "x.bin"}, [](const fs::path& dir) {
    SmallScene().write(dir);
    fs::remove(dir / "x.bin");
    return "x.gltf -o out";
  });
  add("missing texture", 0, {"wall.png"}, [](const fs::path& dir) {
    return spoiled(dir, [](SmallScene& s) {
      replace(s.json, R"("baseColorFactor")", R"("baseColorTexture":{"index":0},"baseColorFactor")");
      replace(s.json, R"("buffers")", R"("textures":[{"source":0}],"images":[{"uri":"wall.png"}],"buffers")");
    });
  });
  add("index out of range", 2, {"x.gltf", "square", "9"},
      [](const fs::path& dir) { return spoiled(dir, [](SmallScene& s) { s.indices[4] = 9; }); });
  add("NaN position", 2, {"x.gltf", "square", "vertex 1"},
      [nan](const fs::path& dir) { return spoiled(dir, [nan](SmallScene& s) { s.positions[4] = nan; }); });
  add("infinite position", 2, {"x.gltf", "square", "vertex 3"},
      [inf](const fs::path& dir) { return spoiled(dir, [inf](SmallScene& s) { s.positions[10] = inf; }); });
  add("zero-area triangle", 0, {"without area", "square"},
      [](const fs::path& dir) { return spoiled(dir, [](SmallScene& s) { s.indices[5] = 2; }); });
  add("empty mesh", 0, {"square"}, [](const fs::path& dir) {
    return spoiled(dir, [](SmallScene& s) {
      replace(
          s.json, R"("indices":2,"material":0}]})",
          R"("indices":2,"material":0}, {"attributes":{"POSITION":0,"TEXCOORD_1":1},"indices":3,"material":0}]})");
      replace(
          s.json, R"("count":6,"type":"SCALAR"})",
          R"("count":6,"type":"SCALAR"},{"bufferView":2,"componentType":5123,"count":3,"type":"SCALAR"})");
      s.indices[1] = s.indices[2] = 0;  // the second primitive's only triangle has no area
    });
  });
  add("singular node transform", 0, {"flat", "singular"}, [](const fs::path& dir) {
    return spoiled(dir, [](SmallScene& s) {
      replace(s.json, R"("nodes":[0,1])", R"("nodes":[0,1,2])");
      replace(s.json, R"({"name":"lamp")", R"({"name":"lamp")");
      replace(s.json, R"("light":0}}}])", R"("light":0}}},{"name":"flat","mesh":0,"scale":[1,0,1]}])");
    });
  });
  add("cyclic nodes", 2, {"x.gltf", "cycl"}, [](const fs::path& dir) {
    return spoiled(dir, [](SmallScene& s) {
      replace(s.json, R"("light":0}}}])",
              R"("light":0}}},{"name":"a","children":[3]},{"name":"b","children":[2]}])");
      replace(s.json, R"("nodes":[0,1])", R"("nodes":[0,1,2])");
    });
  });
  add("a level of detail off the baked one", 2,
      {"x.gltf", "'low'", "node 0 'floor'", "4 m away", "--lod-distance"}, [](const fs::path& dir) {
        return spoiled(dir, [](SmallScene& s) {
          replace(s.json, R"("name":"floor",)", R"("name":"floor","extensions":{"MSFT_lod":{"ids":[2]}},)");
          replace(s.json, R"("light":0}}}])",
                  R"("light":0}}},{"name":"low","mesh":0,"translation":[0,4,0]}])");
        });
      });
  add("a level of detail that does not exist", 2, {"x.gltf", "node 0 'floor'", "MSFT_lod", "node 9"},
      [](const fs::path& dir) {
        return spoiled(dir, [](SmallScene& s) {
          replace(s.json, R"("name":"floor",)", R"("name":"floor","extensions":{"MSFT_lod":{"ids":[9]}},)");
        });
      });
  add("overlapping lightmap UVs, layout atlas", 2, {"floor", "itself"}, [](const fs::path& dir) {
    return spoiled(
        dir, [](SmallScene& s) { s.uv = {0, 0, 0, 1, 1, 1, 0.1f, 0.9f}; }, "--layout atlas --resolution 32");
  });
  add("two objects on one place of the lightmap, layout atlas", 2, {"floor", "second"},
      [](const fs::path& dir) {
        return spoiled(
            dir,
            [](SmallScene& s) {
              replace(s.json, R"("nodes":[0,1])", R"("nodes":[0,1,2])");
              replace(s.json, R"("light":0}}}])",
                      R"("light":0}}},{"name":"second","mesh":0,"translation":[3,0,0]}])");
            },
            "--layout atlas --resolution 32");
      });
  add("the same under layout auto", 0, {"pack was chosen"}, [](const fs::path& dir) {
    return spoiled(dir, [](SmallScene& s) {
      replace(s.json, R"("nodes":[0,1])", R"("nodes":[0,1,2])");
      replace(s.json, R"("light":0}}}])",
              R"("light":0}}},{"name":"second","mesh":0,"translation":[3,0,0]}])");
    });
  });
  add("lightmap UVs out of range, layout atlas", 2, {"floor", "[0, 1]"}, [](const fs::path& dir) {
    return spoiled(
        dir, [](SmallScene& s) { s.uv[4] = 1.5f; }, "--layout atlas");
  });
  for (const auto& [name, value] :
       std::map<std::string, float>{{"a NaN", nan}, {"an infinite", inf}, {"a negative", -1.0f}})
    add("environment with " + name + " texel", 2, {"sky.exr", "(5, 2)"},
        [value = value](const fs::path& dir) {
          write_environment(dir / "sky.exr", value);
          return spoiled(
              dir, [](SmallScene&) {}, "--environment sky.exr");
        });
  add("missing environment", 2, {"sky.hdr"}, [](const fs::path& dir) {
    return spoiled(
        dir, [](SmallScene&) {}, "--environment sky.hdr");
  });
  add("no light at all", 0, {"no light", "black"}, [](const fs::path& dir) {
    return spoiled(dir, [](SmallScene& s) { replace(s.json, R"("intensity":5)", R"("intensity":0)"); });
  });
  add("unwritable output folder", 2, {"plainfile"}, [](const fs::path& dir) {
    EXPECT_TRUE(write_file_atomic(dir / "plainfile", "x"));
    SmallScene().write(dir);
    return "x.gltf -o plainfile/out";
  });
  add("unwritable output folder, before the scene is read", 2,
      {"cannot make the output folder plainfile/out"}, [](const fs::path& dir) {
        EXPECT_TRUE(write_file_atomic(dir / "plainfile", "x"));
        EXPECT_TRUE(write_file_atomic(dir / "x.gltf", "{ broken"));
        return "x.gltf -o plainfile/out";
      });
  add("nothing but triangles without area", 2, {"x.gltf", "no triangles"}, [](const fs::path& dir) {
    return spoiled(dir, [](SmallScene& s) { s.indices = {0, 0, 1, 2, 2, 3}; });
  });
  add("no texel is covered", 2, {"no texel"}, [](const fs::path& dir) {
    return spoiled(
        dir,
        [](SmallScene& s) {
          for (float& u : s.uv) u = 0.5f + 1e-6f * u;
        },
        "--layout atlas --resolution 16");
  });
  add("another file as the kept layout", 2, {"charts.json", "format", "--keep-layout"},
      [](const fs::path& dir) {
        EXPECT_TRUE(write_file_atomic(dir / "charts.json", R"({"width": 4})"));
        return spoiled(
            dir, [](SmallScene&) {}, "--layout pack --keep-layout charts.json");
      });
  add("density too high", 2, {"--texels-per-metre"}, [](const fs::path& dir) {
    return spoiled(
        dir, [](SmallScene&) {}, "--layout pack --texels-per-metre 8000");
  });
  add("required extension that is not supported", 2, {"KHR_texture_basisu"}, [](const fs::path& dir) {
    return spoiled(dir, [](SmallScene& s) {
      replace(s.json, R"("scene":0)", R"("extensionsRequired":["KHR_texture_basisu"],"scene":0)");
    });
  });
  add("unknown setting in a job file", 2, {"job.json", "colour"}, [](const fs::path& dir) {
    EXPECT_TRUE(write_file_atomic(dir / "job.json", R"({"colour": 1})"));
    SmallScene().write(dir);
    return "x.gltf -o out --config job.json";
  });
  add("unknown quantity", 2, {"--quantities", "'shadow'", "light, ao, sky, bent"}, [](const fs::path& dir) {
    return spoiled(
        dir, [](SmallScene&) {}, "--quantities light,shadow");
  });
  add("occlusion within no distance", 2, {"--ao-distance 0"}, [](const fs::path& dir) {
    return spoiled(
        dir, [](SmallScene&) {}, "--quantities ao --ao-distance 0");
  });
  add("charts sized by their light alone", 2, {"--two-pass", "ao", "leave it off"}, [](const fs::path& dir) {
    return spoiled(
        dir, [](SmallScene&) {}, "--quantities light,ao --two-pass on");
  });
  add("lamps to be left out of a map without light", 2, {"--lamps drop", "ao", "--lamps keep"},
      [](const fs::path& dir) {
        return spoiled(
            dir, [](SmallScene&) {}, "--quantities ao --lamps drop");
      });
  add("lamps to be marked in a map of reflections", 2, {"--lamps mark", "indirect", "--lamps keep"},
      [](const fs::path& dir) {
        return spoiled(
            dir, [](SmallScene&) {}, "--components indirect --lamps mark");
      });
  add("light in textures without light", 2, {"--embed-basecolor on", "ao", "leave it off"},
      [](const fs::path& dir) {
        return spoiled(
            dir, [](SmallScene&) {}, "--quantities ao --embed-basecolor on");
      });
  add("parts of a light of which only one is baked", 2, {"--split", "--components indirect", "leave out one"},
      [](const fs::path& dir) {
        return spoiled(
            dir, [](SmallScene&) {}, "--components indirect --split direct,indirect");
      });
  add("value out of range", 2, {"--error", "-1"}, [](const fs::path& dir) {
    return spoiled(
        dir, [](SmallScene&) {}, "--error=-1");
  });
  return all;
}

struct Outcome {
  int status;
  std::string message;
};

// Lines that matter to a user: errors, warnings; paths shortened to file names.
Outcome run(const Case& c, const fs::path& dir) {
  const std::string arguments = c.make(dir);
  const auto result = test::run_kiln(dir, "bake " + arguments + " --quiet");
  Outcome out{result.exit_status, {}};
  std::istringstream lines(result.output);
  for (std::string line; std::getline(lines, line);)
    if (line.rfind("kiln: ", 0) == 0 || line.rfind("warning: ", 0) == 0 || line.rfind("note: ", 0) == 0)
      out.message += (out.message.empty() ? "" : " ") + line;
  return out;
}

std::string table_row(const Case& c, const Outcome& o) {
  std::string message = o.message;
  for (size_t at = 0; (at = message.find('|', at)) != std::string::npos; at += 2)
    message.replace(at, 1, "\\|");
  // How many texels fit is a matter of the machine's memory.
  if (c.name == "density too high")
    message = std::regex_replace(message, std::regex("[0-9.]+ (million|would)"), "... $1");
  return "| " + c.name + " | " + std::to_string(o.status) + " | " + message + " |";
}

class BadInput : public testing::TestWithParam<size_t> {};

TEST_P(BadInput, IsAnsweredClearly) {
  const Case c = cases()[GetParam()];
  SCOPED_TRACE(c.name);
  test::TempDir dir;
  const Outcome o = run(c, dir.path());
  EXPECT_EQ(o.status, c.status) << o.message;
  for (const std::string& part : c.must_contain)
    EXPECT_NE(o.message.find(part), std::string::npos) << o.message;
  if (c.status != 0) {
    EXPECT_FALSE(fs::exists(dir.path() / "out") && !fs::is_empty(dir.path() / "out"))
        << "something was left in out/";
  }
}

INSTANTIATE_TEST_SUITE_P(All, BadInput, testing::Range<size_t>(0, cases().size()),
                         [](const auto& info) { return "Case" + std::to_string(info.param); });

TEST(BadInputDisk, NotEnoughSpaceIsSaidBeforeTheBake) {
  test::TempDir dir;
  const fs::path small = dir.path() / "small";
  fs::create_directories(small);
  if (::mount("none", small.c_str(), "tmpfs", 0, "size=16k") != 0)
    GTEST_SKIP() << "no right to mount a small file system";
  SmallScene().write(dir.path());
  const auto result = test::run_kiln(dir.path(), "bake x.gltf -o small/out --quiet --texels-per-metre 64");
  const bool clean = !fs::exists(small / "out") || fs::is_empty(small / "out");
  ::umount(small.c_str());
  EXPECT_EQ(result.exit_status, 2) << result.output;
  EXPECT_NE(result.output.find("MiB"), std::string::npos) << result.output;
  EXPECT_TRUE(clean);
}

TEST(BadInputTable, DocsSayWhatTheProgramSays) {
  std::string rows = "| input | exit | what the user reads |\n|---|---|---|\n";
  for (const Case& c : cases()) {
    test::TempDir dir;
    rows += table_row(c, run(c, dir.path())) + "\n";
  }
  const fs::path page = test::source_dir() / "docs/testing.md";
  const auto bytes = read_file(page);
  ASSERT_TRUE(bytes);
  std::string text(reinterpret_cast<const char*>(bytes->data()), bytes->size());
  const std::string begin = "<!-- bad inputs -->\n", end = "<!-- end of bad inputs -->";
  const size_t from = text.find(begin), to = text.find(end);
  ASSERT_TRUE(from != std::string::npos && to != std::string::npos);
  if (::getenv("KILN_WRITE_DOCS")) {
    text.replace(from + begin.size(), to - from - begin.size(), rows);
    ASSERT_TRUE(write_file_atomic(page, text));
    return;
  }
  EXPECT_EQ(text.substr(from + begin.size(), to - from - begin.size()), rows)
      << "run cli_test with KILN_WRITE_DOCS=1 and read the difference";
}

}  // namespace
}  // namespace kiln
