// Writes the seeds of the fuzz corpus: fuzz_seeds FOLDER. Inputs that crashed once stand beside them and
// stay.
#include <cstdio>
#include <fstream>

#include "common/atlas/atlas.h"
#include "common/base/files.h"
#include "common/base/json.h"
#include "common/job/irradiance_cache.h"
#include "common/job/settings.h"
#include "common/probes/probe_points.h"
#include "common/scene/prepared.h"
#include "common/tls/certificate.h"
#include "common/zstd/compress.h"
#include "coordinator/farm/authority/tokens.h"
#include "coordinator/farm/queue/spool_record.h"
#include "coordinator/output/chart_table/chart_table.h"
#include "coordinator/output/container/container.h"
#include "coordinator/scene/imageio/exr.h"
#include "coordinator/scene/imageio/imageio.h"
#include "tests/fuzz/atlas_scene.h"
#include "tests/fuzz/target.h"
#include "tests/import/gltf_builder.h"
#include "tests/wire/samples.h"
#include "worker/agent/recording.h"
#include "worker/agent/replay.h"

namespace kiln::fuzz {
namespace {
namespace fs = std::filesystem;

fs::path root;

void seed(const std::string& target, const std::string& name, std::span<const std::byte> bytes) {
  fs::create_directories(root / target);
  require(write_file_atomic(root / target / name, bytes).has_value(), "a seed can be written");
}
void seed(const std::string& target, const std::string& name, std::string_view text) {
  seed(target, name, bytes_of(text));
}

void wire_seeds() {
  int number = 0;
  for (const Message& message : test::sample_messages()) {
    const Bytes frame = encode(message);
    const std::string name = "sample-" + std::to_string(number++);
    seed("frame", name, frame);
    Bytes input(frame.begin() + 4, frame.begin() + 6);  // the type
    input.insert(input.end(), frame.begin() + kFrameHeaderBytes, frame.end());
    seed("messages", name, input);
  }
  for (uint64_t n = 0; n < test::kSamplesOfAType; ++n) {
    const std::string name = "sample-" + std::to_string(n);
    seed("job", name, write_job(test::sample<JobSpec>(n)));
    seed("result", name, write_result(test::sample<UnitResult>(n)));
  }
  Bytes recording = write_recording_head();
  const auto add_record = [&](Recorded kind, uint64_t at_ms, Bytes content) {
    const Bytes bytes = write_record({kind, at_ms, std::move(content)});
    recording.insert(recording.end(), bytes.begin(), bytes.end());
  };
  add_record(Recorded::kOpened, 0, {});
  for (const Message& message : test::sample_messages())
    add_record(message.index() % 2 ? Recorded::kReceived : Recorded::kSent, message.index(), encode(message));
  add_record(Recorded::kClosed, 100, Bytes(5, std::byte{'x'}));
  seed("recording", "conversation", recording);
  const Bytes packed = compress(Bytes(5000, std::byte{3}));
  ByteWriter w;
  for (const int byte : {5000 & 255, 5000 >> 8, 0}) w.put(static_cast<uint8_t>(byte));
  Bytes input = w.take();
  input.insert(input.end(), packed.begin(), packed.end());
  seed("decompress", "run", input);
  UnitResult result;
  result.unit = 9, result.site_count = 2, result.plane_count = 2, result.moments = {1, 2, 3, 4};
  const Bytes payload = write_result(result);
  const auto cache_seed = [](const char* name, const IrradianceCache& cache) {
    ByteWriter sites;
    sites.put(static_cast<uint32_t>(cache.irradiance.size()));
    Bytes input = sites.take();
    const Bytes blob = write_irradiance_cache(cache);
    input.insert(input.end(), blob.begin(), blob.end());
    seed("irradiance", name, input);
  };
  cache_seed("known", {{Vec3(1, 2, 3), Vec3(0), Vec3(-1), Vec3(0.25f, 1e-30f, 1e30f)}});
  cache_seed("no-sites", {});
  IrradianceCache drawn{{Vec3(1, 2, 3), Vec3(0)}, std::vector<CacheDraws>(2)};
  for (size_t k = 0; k < kCacheDraws; ++k) drawn.draws[0].set(k, k % 2 ? -0.5f : 1e-3f);
  cache_seed("drawn", drawn);
  const auto text_seed = [](const char* target, const char* name, std::string_view words) {
    const auto bytes = bytes_of(words);
    seed(target, name, Bytes(bytes.begin(), bytes.end()));
  };
  text_seed("json", "document", R"({"id":7,"after":[1,2],"name":"a\u00e9","deep":{"x":[true,null,-1.5e3]}})");
  seed("probes", "two", write_probe_points({{{Vec3(0, 1, 2), 3}, {Vec3(-1, 0.5f, 0), 1}}}));
  seed("probes", "no_reach", write_probe_points({{{Vec3(0, 1, 2), 0}}}));
  text_seed("probe_file", "hall.json",
            R"({"version":1,"volumes":[{"name":"hall","min":[0,0,0],"max":[12,4,20],"spacing":0.5,)"
            R"("max_spacing":2,"visibility":true}]})");
  text_seed("probe_file", "flat.json",
            R"({"version":1,"volumes":[{"min":[0,0,0],"max":[1,0,1],"spacing":1}]})");
  text_seed("head", "get",
            "GET /api/jobs/7.json?x=1 HTTP/1.1\r\nHost: localhost:7801\r\nAuthorization: Bearer abc\r\n\r\n");
  text_seed("replay", "unit", write_replay({{7, {}, {}, {}}, {9, 64, 32, {1, 2, 3}}}, {}));
  text_seed("replay", "cached", write_replay({{7, {}, {}, {}}, {9, 64, 32, {1, 2, 3}, 1, sha256({})}}, {}));
  const auto head = write_spool_head({1, 9, 77, result_digest(result), "w", false}, payload);
  ByteWriter spool;
  spool.put(static_cast<uint32_t>(payload.size()));
  spool.put(uint16_t{0});
  Bytes record = spool.take();
  record.insert(record.end(), head.begin(), head.end());
  record.insert(record.end(), payload.begin(), payload.end());
  seed("spool", "record", record);
}

void texture_seeds() {
  for (const TextureFormatInfo& info : texture_formats()) {
    TextureImages texture{info.format, 6, 3, {}};
    for (uint32_t side = 6; side > 0; side /= 2)
      texture.levels.emplace_back(
          2, Bytes(image_bytes(info.format, side, std::max(1u, side / 2)), std::byte{0x5a}));
    const std::string name(info.name);
    if (info.dxgi) seed("dds", name, *write_dds(texture));
    seed("ktx2", name, *write_ktx2(texture, 0));
    seed("ktx2", name + "-zstd", *write_ktx2(texture, 3, {{"kiln", "seed"}}));
  }
}

void scene_seeds() {
  const Scene scene = atlas_scene();
  ChunkStore store;
  const Digest id = write_scene(scene, store);
  Bytes input;
  const auto add = [&](const Bytes& chunk) {
    ByteWriter w;
    w.put(static_cast<uint32_t>(chunk.size()));
    const Bytes size = w.take();
    input.insert(input.end(), size.begin(), size.end());
    input.insert(input.end(), chunk.begin(), chunk.end());
  };
  add(*store.find(id));
  const auto chunks = scene_chunks(*store.find(id));
  require(chunks.has_value(), "a scene that was written can be read");
  for (const Digest& chunk : *chunks) add(*store.find(chunk));
  seed("scene", "quads", input);

  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  settings.texels_per_metre = 3;
  const auto atlas = build_atlas(scene, settings);
  require(atlas.has_value(), "the fixed scene has an atlas");
  seed("atlas", "quads", write_atlas(*atlas));
  seed("layout", "quads.json", charts_json(scene, *atlas));
}

void text_seeds() {
  std::string defaults = "{";
  const BakeSettings settings;
  for (const Setting& row : settings_table())
    defaults +=
        (defaults.size() > 1 ? ", " : "") + json_quote(row.name) + ": " + json_quote(row.print(settings));
  seed("settings", "defaults.json", defaults + "}");
  seed(
      "settings", "some.json",
      R"({"basis": "sh1", "target-error": 0.02, "seed": 7, "sun": "45,30,1000", "quiet": true, "a": [1, 2, 3]})");
  seed("ies", "quadrant.ies",
       "IESNA:LM-63-2002\r\n[TEST] a lamp\r\nTILT=NONE\r\n1 1000 2 3 3 1 2 0.1 0.1 0\r\n0.5 4 100\r\n0 45 "
       "90\r\n"
       "0 30 90\r\n100 50 10 101 51 11 102 52 12\r\n");
  seed("ies", "tilt.ies",
       "IESNA91\nTILT=INCLUDE\n1\n2\n0 90\n1 0.9\n1 1000 2 3 1 1 2 0.1 0.1 0\n0.5 4 100\n0 45 90\n0\n100 50 "
       "10\n");
}

void image_seeds() {
  std::vector<float> ramp(8 * 4 * 3);
  for (size_t i = 0; i < ramp.size(); ++i) ramp[i] = static_cast<float>(i) / 8;
  const fs::path file = as_file({}, ".exr");
  const ExrChannel channels[] = {{"R", ramp.data()}, {"G", ramp.data() + 32}, {"B", ramp.data() + 64}};
  require(write_exr(file, 8, 4, channels).has_value(), "an EXR can be written");
  const Bytes exr = *read_file(file);
  seed("exr", "ramp.exr", exr);
  seed("environment", "ramp.exr", exr);
  std::string hdr = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 2 +X 4\n";
  for (int i = 0; i < 8; ++i) hdr += {static_cast<char>(20 * i), 90, 7, static_cast<char>(128)};
  seed("environment", "flat.hdr", hdr);
  std::vector<uint8_t> rgb(5 * 3 * 3);
  for (size_t i = 0; i < rgb.size(); ++i) rgb[i] = static_cast<uint8_t>(i * 5);
  seed("image", "ramp.png", *encode_png(5, 3, rgb));
}

void gltf_seeds() {
  const auto glb = [](const test::GltfBuilder& b) {
    const fs::path folder = as_file({}, ".glb").parent_path();
    return *read_file(test::write_glb_file(b, folder, "x.glb"));
  };
  seed("gltf", "small.glb", glb(test::small_scene()));
  seed("gltf", "rich.glb", glb(test::rich_scene()));
  seed("gltf", "data-uri.gltf",
       R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],)"
       R"("meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],"buffers":[{"byteLength":36,"uri":)"
       R"("data:application/octet-stream;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAAAAAAAAgD8AAAAA"}],)"
       R"("bufferViews":[{"buffer":0,"byteLength":36}],"accessors":[{"bufferView":0,"componentType":5126,)"
       R"("count":3,"type":"VEC3"}]})");
}

void trust_seeds() {
  const int64_t day = 86400, now = 1'800'000'000;
  const auto authority = make_authority("farm", now, now + day);
  const auto own = make_key_and_request("render7");
  const auto leaf = sign_request(
      own->request, *authority,
      {"render7", {Role::kWorker, Role::kCoordinator}, {"a.b", "10.0.0.7", "::1"}, now, now + day});
  seed("certificate", "authority.pem", "c" + authority->certificate);
  seed("certificate", "leaf.pem", "c" + *leaf);
  seed("certificate", "request.pem", "r" + own->request);
  seed("certificate", "revoked", "v0a1b  # gone\n\nFFFF\n");
  // DER is what base64 in the PEM says: taken out of it here, so that the fuzzer need not invent base64.
  std::string der = "d";
  uint32_t bits = 0, count = 0;
  const size_t body = leaf->find('\n') + 1;
  for (const char c : leaf->substr(body, leaf->find("-----END") - body)) {
    static const std::string_view kDigits =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const size_t digit = kDigits.find(c);
    if (digit == std::string_view::npos) continue;
    bits = bits << 6 | static_cast<uint32_t>(digit);
    if (++count % 4 == 0)
      for (int shift = 16; shift >= 0; shift -= 8) der += static_cast<char>(bits >> shift & 255);
  }
  seed("certificate", "leaf.der", der);
  const Digest d = sha256(bytes_of("x"));
  seed("tokens", "file",
       print_token_file({{"01234567", d, Role::kWorker, 3, now}, {"89abcdef", d, Role::kRead, 0, 5}}));
  seed("tokens", "typed", JoinToken{"01234567", std::string(32, 'a'), d}.text());
}

}  // namespace
}  // namespace kiln::fuzz

int main(int argc, char** argv) {
  if (argc != 2) {
    std::fprintf(stderr, "usage: fuzz_seeds FOLDER\n");
    return 2;
  }
  kiln::fuzz::root = argv[1];
  kiln::fuzz::wire_seeds();
  kiln::fuzz::scene_seeds();
  kiln::fuzz::texture_seeds();
  kiln::fuzz::text_seeds();
  kiln::fuzz::image_seeds();
  kiln::fuzz::gltf_seeds();
  kiln::fuzz::trust_seeds();
}
