// What a bake reads, by content: the files of a scene and its settings are listed, hashed, kept as blobs and
// laid out again elsewhere, so that a job of a farm is not changed by who edits the scene while it waits.
#pragma once

#include <filesystem>
#include <string>
#include <vector>

#include "common/job/settings.h"
#include "coordinator/farm/queue/blobs.h"
#include "coordinator/farm/queue/records.h"

namespace kiln {

struct InputFile {
  std::string path;  // in the snapshot: as seen from the scene's folder; files of options under kOptions
  std::filesystem::path source;  // where it is now
};

// Files that options name lie here, each in a folder of its option's name.
inline constexpr const char* kOptions = "kiln-options";

// Every file that a bake of this scene with these settings reads, the scene first, then by path: external
// buffers, all images (the written scene.glb holds them too), IES profiles, the environment's image, the
// layout to keep, and NAME.kiln.json, the scene's own job file. Files that the scene names and that are not
// there are left out: import says what it says of them, here and there. Fails (kInvalidInput) as import does
// on a glTF that cannot be read and on URIs that leave the scene's folder, and on an option's file that is
// not there.
Expected<std::vector<InputFile>> list_inputs(const std::filesystem::path& scene,
                                             const BakeSettings& settings);

struct Snapshot {
  std::string scene;  // path of the glTF among `files`
  std::vector<FileRecord> files;
  std::vector<std::filesystem::path> sources;  // of each
  BakeSettings settings;                       // files of options by their path in the snapshot
};

// Lists and hashes (SHA-256, in pieces of 1 MiB).
Expected<Snapshot> take_snapshot(const std::filesystem::path& scene, const BakeSettings& settings);

// Puts the files of a snapshot on this machine into the store. Fails (kInvalidInput) if one has changed
// since.
Status put_snapshot(const Snapshot& snapshot, BlobStore& blobs, int64_t now_ms);

// Makes the files in `folder`, which is made and must be empty: hard links to the blobs where the file system
// can, else copies. They are for reading. Fails (kInvalidInput) on a path that leaves the folder and on a
// blob that is not there.
Status lay_out(const std::vector<FileRecord>& files, const BlobStore& blobs,
               const std::filesystem::path& folder);

// The settings of a snapshot for files laid out in `folder`; options whose value is no path of the snapshot
// stay.
BakeSettings settings_in(BakeSettings settings, const std::filesystem::path& folder);

}  // namespace kiln
