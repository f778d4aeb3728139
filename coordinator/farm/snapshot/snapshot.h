// A bake's input by content: a scene's files and settings are listed, hashed, stored as blobs and laid out
// again elsewhere, so that edits to the scene do not change a queued job.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/job/settings.h"
#include "coordinator/farm/queue/blobs.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

struct InputFile {
  std::string path;  // in the snapshot: relative to the scene's folder; files of options under kOptions
  std::filesystem::path source;  // where it is now
};

// Folder of files named by options, each in a subfolder with its option's name.
inline constexpr const char* kOptions = "kiln-options";

// Which files of this machine a scene may name. Whoever made it may not be who submits it.
struct InputRules {
  bool allow_outside = false;  // files outside the scene's folder, by symbolic links too
  bool own_job_file = false;   // the settings come from NAME.kiln.json, which nobody asked for
};

// Every file that a bake of this scene with these settings reads, the scene first, then by path: external
// buffers, all images (scene.glb includes them), IES profiles, the environment's image, the layout to keep,
// and NAME.kiln.json, the scene's own job file. Missing files of the scene are skipped: import reports them
// on either side. Fails (kInvalidInput) like import on an unreadable glTF and on URIs that leave the scene's
// folder, and on a missing file of an option; and on pipes, devices, and whatever `rules` do not allow.
Expected<std::vector<InputFile>> list_inputs(const std::filesystem::path& scene, const BakeSettings& settings,
                                             const InputRules& rules = {});

struct Snapshot {
  std::string scene;  // path of the glTF among `files`
  std::vector<FileRecord> files;
  std::vector<std::filesystem::path> sources;  // of each
  BakeSettings settings;                       // files of options as paths in the snapshot
};

// Lists and hashes (SHA-256, in pieces of 1 MiB).
Expected<Snapshot> take_snapshot(const std::filesystem::path& scene, const BakeSettings& settings,
                                 const InputRules& rules = {});

// Copies a snapshot's files from this machine into the store. Fails (kInvalidInput) if one has changed since.
Status put_snapshot(const Snapshot& snapshot, BlobStore& blobs, int64_t now_ms);

// Creates the files in `folder`, which is created and must be empty: hard links to the blobs where the file
// system allows, else copies. They are for reading. Each is read and held against its digest: a damaged blob
// is set aside. Fails (kInvalidInput) on a path that leaves the folder and on a missing or damaged blob,
// naming the file and the way out; then nothing is left.
Status lay_out(const std::vector<FileRecord>& files, BlobStore& blobs, const std::filesystem::path& folder);

// A snapshot's settings for files laid out in `folder`; options whose value is not a path of the snapshot are
// unchanged.
BakeSettings settings_in(BakeSettings settings, const std::filesystem::path& folder);

}  // namespace kiln
