#include "coordinator/measure/bench/reference.h"

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/base/json.h"
#include "common/base/release.h"
#include "common/math/sequence.h"
#include "common/scene/prepared.h"
#include "common/unwrap/unwrap_cache.h"

namespace kiln {
namespace {

namespace fs = std::filesystem;

constexpr uint64_t kMaxJson = 1 << 20;
constexpr uint64_t kReferenceSeed = 9007199254740000;  // within the range of --seed, far from small numbers

std::string half_name(uint32_t half) {
  return text("half{}", half);
}

// Everything that decides a reference's bytes. The release counts: the next one may bake differently.
Expected<std::string> identity_of(const ReferenceRequest& r) {
  const BakeSettings s = reference_settings(r, 0);
  std::vector<StageTime> times;
  KILN_TRY(const Preflight pre, run_preflight(r.scene, s, times, [](const BakeProgress&) {}));
  ChunkStore chunks;
  const Digest scene = write_scene(pre.imported.scene, chunks), atlas = chunks.add(write_atlas(pre.atlas));
  return text(
      "kiln reference 1\nrelease {}\nscene {}\natlas {}\ndirect {}\nindirect {}\nmax-bounces {}\nwatertight "
      "{}\n"
      "isa {}\nsamples {}\n{}",
      release_number(), scene.hex(), atlas.hex(), s.direct, s.indirect, s.max_bounces, s.watertight, s.isa,
      r.samples,
      text("{}{}{}", r.cache ? "cache on\n" : "",
           r.share < 1 ? text("share {} of blocks of {}\n", r.share, kReferenceBlock) : "",
           r.error > 0 ? text("error {}\n", r.error) : ""));
}

Expected<std::string> digest_of(const fs::path& file) {
  KILN_TRY(const Bytes bytes, read_file(file));
  return sha256(bytes).hex();
}

// Keeps the files of a bake's folder that compare reads, and returns their names.
Expected<std::vector<std::string>> keep_maps(const fs::path& folder) {
  std::vector<std::string> kept;
  std::vector<fs::path> gone;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const bool keep =
        name.ends_with(".exr") && (name.starts_with("irradiance.") || name.starts_with("validity."));
    keep ? kept.push_back(name) : gone.push_back(entry.path());
  }
  for (const fs::path& path : gone) fs::remove_all(path);
  std::sort(kept.begin(), kept.end());
  return kept;
}

Status make_reference(const ReferenceRequest& r, const std::string& identity, const fs::path& folder,
                      const std::function<void(const BakeProgress&)>& progress) {
  JsonWriter w;
  w.begin_object().pair("format", "kiln reference").pair("version", 1).pair("identity", identity);
  w.key("files").begin_object();
  for (uint32_t half = 0; half < 2; ++half) {
    BakeRequest bake;
    bake.scene = r.scene;
    bake.output = folder / half_name(half);
    bake.settings = reference_settings(r, half);
    bake.worker_program = r.worker_program;
    bake.pictures = r.share >= 1;
    if (r.share < 1)
      bake.sampled = [share = r.share](uint32_t texel, uint32_t width) {
        // Pages are stacked; if a page does not end with a block, that block spans two pages.
        return is_reference_block(texel % width / kReferenceBlock, texel / width / kReferenceBlock, share);
      };
    KILN_TRY(const BakeReport report, run_bake(bake, progress));
    KILN_TRY(const std::vector<std::string> files, keep_maps(bake.output));
    for (const std::string& name : files) {
      KILN_TRY(const std::string digest, digest_of(bake.output / name));
      w.pair(half_name(half) + "/" + name, digest);
    }
  }
  w.end_object().end_object();
  return write_file_atomic(folder / "reference.json", w.take());
}

tl::unexpected<Error> damaged(const fs::path& folder, const std::string& what) {
  return fail(ErrorKind::kInvalidInput,
              text("the reference in {} is damaged: {}. Remove that folder: it is then baked "
                   "again",
                   folder.string(), what));
}

Status check_files(const fs::path& folder, const std::string& identity) {
  const auto bytes = read_file(folder / "reference.json", kMaxJson);
  if (!bytes) return damaged(folder, bytes.error().message);
  const auto json = parse_json({reinterpret_cast<const char*>(bytes->data()), bytes->size()});
  if (!json) return damaged(folder, "reference.json: " + json.error().message);
  const JsonValue *own = json->find("identity"), *files = json->find("files");
  if (!own || own->text != identity) return damaged(folder, "reference.json is of another reference");
  if (!files || files->members.empty()) return damaged(folder, "reference.json names no files");
  for (const JsonMember& file : files->members) {
    // Names come from a file: they must stay in the folder.
    const fs::path name = file.first;
    if (name.has_root_path() || file.first.find("..") != std::string::npos)
      return damaged(folder, text("reference.json names '{}'", file.first));
    const auto digest = digest_of(folder / name);
    if (!digest) return damaged(folder, digest.error().message);
    if (*digest != file.second.text) return damaged(folder, text("{} is not what was written", file.first));
  }
  return {};
}

}  // namespace

BakeSettings reference_settings(const ReferenceRequest& r, uint32_t half) {
  BakeSettings settings = r.settings;
  settings.basis = "irradiance";
  settings.encodings.clear();
  settings.embed_basecolor = settings.instanced = settings.seams = false;
  settings.dilate = 0;
  settings.cache = r.cache;
  settings.denoise = settings.two_pass = false;
  settings.sampler = "owen";
  settings.min_samples = settings.max_samples = r.samples;
  if (r.error > 0) {
    settings.min_samples = std::max(1u, r.samples / kLeastShare);
    settings.error = r.error;
    settings.confidence = BakeSettings().confidence;
    settings.error_norm = "mean-square";
  }
  settings.time_limit = 0;
  settings.seed = kReferenceSeed + half;
  return settings;
}

bool is_reference_block(uint32_t column, uint32_t row, double share) {
  constexpr uint64_t kKey = 0x6b696c6e20726566;  // for this purpose only: no sampler uses it
  const uint64_t hash = mix_bits(kKey ^ mix_bits(uint64_t{row} << 32 | column));
  return static_cast<double>(hash >> 11) * 0x1p-53 < share;
}

fs::path default_reference_folder() {
  const fs::path cache = default_cache_folder();
  return cache.empty() ? cache : cache / "references";
}

Expected<Reference> obtain_reference(const ReferenceRequest& r,
                                     const std::function<void(const BakeProgress&)>& progress) {
  const Stopwatch watch;
  if (r.share < 1 && r.cache)
    return fail(
        ErrorKind::kUsage,
        "--reference-share and --reference-cache do not go together: paths would end at texels that are "
        "not baked. Leave one of them out");
  KILN_TRY(const std::string identity, identity_of(r));
  Reference reference;
  reference.key = sha256(std::as_bytes(std::span(identity))).hex();
  reference.folder = r.folder / reference.key;
  std::error_code code;
  reference.reused = fs::exists(reference.folder, code);
  if (!reference.reused) {
    KILN_TRY_STATUS(prepare_output_folder(r.folder, 0));
    const fs::path making = r.folder / text("making-{}", random_hex(8));
    Status made = make_reference(r, identity, making, progress);
    if (made) fs::rename(making, reference.folder, code);
    // If another process was faster, its folder is there, with the same bytes.
    fs::remove_all(making, code);
    KILN_TRY_STATUS(made);
  }
  KILN_TRY_STATUS(check_files(reference.folder, identity));
  for (uint32_t half = 0; half < 2; ++half) {
    KILN_TRY(reference.half[half], read_error_map(reference.folder / half_name(half)));
  }
  reference.seconds = watch.seconds();
  return reference;
}

}  // namespace kiln
