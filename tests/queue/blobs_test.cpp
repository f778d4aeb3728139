// Blobs: uploads that break off, lie or are too big; and what is collected when.
#include "coordinator/farm/queue/blobs.h"

#include <thread>

#include "common/base/files.h"
#include "tests/queue/faulty_disk.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

std::unique_ptr<BlobStore> open_blobs(const fs::path& folder, BlobOptions options = {}) {
  options.keep_free = options.keep_free_publishing = 0;
  auto blobs = BlobStore::open(folder, options);
  if (blobs) return std::move(*blobs);
  ADD_FAILURE() << blobs.error().message;
  return nullptr;
}

struct Upload1 {
  Bytes bytes = sample_payload(5, 100000);
  Digest digest = sha256(bytes);
  std::span<const std::byte> part(size_t from, size_t size) const {
    return std::span(bytes).subspan(from, size);
  }
};

Digest put_bytes(BlobStore& blobs, const Bytes& bytes, int64_t now_ms) {
  const Digest digest = sha256(bytes);
  EXPECT_TRUE(blobs.begin(digest, bytes.size()));
  EXPECT_TRUE(blobs.append(digest, 0, bytes));
  EXPECT_TRUE(blobs.finish(digest, now_ms));
  return digest;
}

TEST(Blobs, AnUploadGoesOnWhereItBrokeOff) {
  const MemoryDir dir;
  const Upload1 up;
  {
    const auto blobs = open_blobs(dir.path());
    EXPECT_EQ(*blobs->begin(up.digest, up.bytes.size()), 0u);
    ASSERT_TRUE(blobs->append(up.digest, 0, up.part(0, 30000)));
    EXPECT_FALSE(blobs->has(up.digest));
    EXPECT_FALSE(blobs->finish(up.digest, 1));  // not whole
    blobs->abandon(up.digest);
    EXPECT_FALSE(blobs->append(up.digest, 30000, up.part(30000, 1)));
  }
  const auto blobs = open_blobs(dir.path());
  EXPECT_EQ(*blobs->begin(up.digest, up.bytes.size()), 30000u);
  EXPECT_FALSE(blobs->append(up.digest, 30001, up.part(30001, 5)));     // a gap
  ASSERT_TRUE(blobs->append(up.digest, 20000, up.part(20000, 20000)));  // half of it is known
  ASSERT_TRUE(blobs->append(up.digest, 0, up.part(0, 10)));             // all of it
  EXPECT_EQ(*blobs->begin(up.digest, up.bytes.size()), 40000u);         // a second sender joins
  ASSERT_TRUE(blobs->append(up.digest, 40000, up.part(40000, 60000)));
  ASSERT_TRUE(blobs->finish(up.digest, 1));
  ASSERT_TRUE(blobs->finish(up.digest, 1));  // of the second
  EXPECT_EQ(*read_file(blobs->path(up.digest)), up.bytes);
  EXPECT_EQ(*blobs->begin(up.digest, up.bytes.size()), up.bytes.size());
  EXPECT_EQ(*blobs->size(up.digest), up.bytes.size());
}

TEST(Blobs, WrongBytesAreRemovedAndTheRightOnesTaken) {
  const MemoryDir dir;
  const Upload1 up;
  const auto blobs = open_blobs(dir.path());
  Bytes wrong = up.bytes;
  wrong[77] ^= std::byte{1};
  ASSERT_TRUE(blobs->begin(up.digest, wrong.size()));
  ASSERT_TRUE(blobs->append(up.digest, 0, wrong));
  const Status refused = blobs->finish(up.digest, 1);
  ASSERT_FALSE(refused);
  EXPECT_EQ(refused.error().kind, ErrorKind::kInvalidInput);
  EXPECT_FALSE(blobs->has(up.digest));
  EXPECT_EQ(*blobs->begin(up.digest, up.bytes.size()), 0u);
  ASSERT_TRUE(blobs->append(up.digest, 0, up.bytes));
  ASSERT_TRUE(blobs->finish(up.digest, 1));
}

TEST(Blobs, ClaimsAboutSizesAreChecked) {
  const MemoryDir dir;
  const Upload1 up;
  BlobOptions options;
  options.blob_bytes = 100000;
  const auto blobs = open_blobs(dir.path(), options);
  EXPECT_EQ(blobs->begin(up.digest, 100001).error().kind, ErrorKind::kInvalidInput);
  ASSERT_TRUE(blobs->begin(up.digest, 50));
  EXPECT_FALSE(blobs->begin(up.digest, 60));
  EXPECT_FALSE(blobs->append(up.digest, 0, up.part(0, 51)));
  EXPECT_FALSE(blobs->append(up.digest, ~uint64_t{0}, up.part(0, 51)));
  EXPECT_EQ(fs::file_size(blobs->path(up.digest).string() + ".part"), 0u);
  EXPECT_FALSE(blobs->append(sha256({}), 0, up.part(0, 1)));  // never begun
  EXPECT_FALSE(blobs->finish(sha256({}), 1));

  // More than the disk has.
  options.blob_bytes = ~uint64_t{0};
  const auto large = open_blobs(dir.path() / "large", options);
  const uint64_t free = fs::space(dir.path()).available;
  EXPECT_EQ(large->begin(up.digest, free * 2).error().kind, ErrorKind::kNoSpace);
  // What others have announced takes nothing: bytes do, when they come.
  ASSERT_TRUE(large->begin(up.digest, free / 3 * 2));
  EXPECT_TRUE(large->begin(sha256({}), free / 3 * 2));
}

TEST(Blobs, OnlyWhatNobodyNeedsIsCollected) {
  const MemoryDir dir;
  const auto blobs = open_blobs(dir.path());
  const Digest needed = put_bytes(*blobs, sample_payload(1, 10), 1000);
  const Digest fresh = put_bytes(*blobs, sample_payload(2, 20), 5000);
  const Digest old = put_bytes(*blobs, sample_payload(3, 30), 1000);
  const Digest used = put_bytes(*blobs, sample_payload(4, 40), 1000);
  EXPECT_TRUE(blobs->use(used, 5000));
  EXPECT_FALSE(blobs->use(sha256({}), 5000));
  // An upload under way, and one that was abandoned; their files are of now, which is long after 1970.
  const Upload1 up;
  ASSERT_TRUE(blobs->begin(up.digest, up.bytes.size()));
  ASSERT_TRUE(blobs->append(up.digest, 0, up.part(0, 50)));
  JobRecord job = sample_job();
  job.inputs.push_back({"x", needed, 10});
  const std::set<Digest> references = referenced_blobs({job});
  EXPECT_EQ(references.size(), 4u);

  EXPECT_EQ(blobs->collect(references, 5000, 4000).blobs, 0u);  // old: just not yet
  const auto collected = blobs->collect(references, 5001, 4000);
  EXPECT_EQ(collected.blobs, 1u);
  EXPECT_EQ(collected.bytes, 30u);
  EXPECT_TRUE(blobs->has(needed) && blobs->has(fresh) && blobs->has(used));
  EXPECT_FALSE(blobs->has(old));
  const int64_t far = int64_t{1} << 50;
  EXPECT_EQ(blobs->collect(references, far, 4000).blobs, 2u);
  EXPECT_TRUE(blobs->has(needed));
  ASSERT_TRUE(blobs->append(up.digest, 50, up.part(50, 50)));  // was left alone
  blobs->abandon(up.digest);
  EXPECT_EQ(blobs->collect(references, far, 4000).bytes, 100u);
  EXPECT_EQ(*blobs->begin(up.digest, up.bytes.size()), 0u);
}

TEST(Blobs, AFailingDiskIsToldAndTriedAgain) {
  const MemoryDir dir;
  const Upload1 up;
  FaultyDisk disk;
  BlobOptions options;
  options.faults = &disk;
  const auto blobs = open_blobs(dir.path() / "a", options);
  ASSERT_TRUE(blobs->begin(up.digest, up.bytes.size()));
  disk.arm(Fault::kNoSpace, 0, 1);
  EXPECT_EQ(blobs->append(up.digest, 0, up.bytes).error().kind, ErrorKind::kNoSpace);
  ASSERT_TRUE(blobs->append(up.digest, 0, up.bytes));
  disk.arm(Fault::kSyncError, 0, 1);
  EXPECT_EQ(blobs->finish(up.digest, 1).error().kind, ErrorKind::kIo);
  EXPECT_FALSE(blobs->has(up.digest));
  ASSERT_TRUE(blobs->finish(up.digest, 1));
  EXPECT_EQ(*read_file(blobs->path(up.digest)), up.bytes);
}

TEST(Blobs, AFileIsPutOnce) {
  const MemoryDir dir;
  const Upload1 up;
  ASSERT_TRUE(write_file_atomic(dir.path() / "scene.bin", up.bytes));
  const auto blobs = open_blobs(dir.path() / "blobs");
  std::vector<std::thread> threads;
  for (int i = 0; i < 4; ++i)
    threads.emplace_back([&] {
      const auto put = blobs->put_file(dir.path() / "scene.bin", 9);
      ASSERT_TRUE(put);
      EXPECT_EQ(*put, (FileRecord{"scene.bin", up.digest, up.bytes.size()}));
    });
  for (std::thread& thread : threads) thread.join();
  EXPECT_EQ(*read_file(blobs->path(up.digest)), up.bytes);
  size_t files = 0;
  for (const auto& entry : fs::recursive_directory_iterator(dir.path() / "blobs"))
    files += entry.is_regular_file();
  EXPECT_EQ(files, 1u);
  EXPECT_FALSE(blobs->put_file(dir.path() / "gone", 9));
}

// A disk of a stated size, whose free space is what the files of a folder leave.
struct SmallDisk final : DiskCalls {
  fs::path folder;
  uint64_t size = 0;
  int free_bytes(const char*, uint64_t& bytes) override {
    uint64_t used = 0;
    for (const auto& entry : fs::recursive_directory_iterator(folder))
      if (entry.is_regular_file()) used += entry.file_size();
    bytes = size - std::min(used, size);
    return 0;
  }
};

TEST(Blobs, AnAnnouncementDoesNotKeepOthersFromPublishing) {
  const MemoryDir dir;
  SmallDisk disk;
  disk.folder = dir.path() / "blobs";
  disk.size = 300000;
  BlobOptions options;
  options.faults = &disk;
  options.keep_free = options.keep_free_publishing = 0;
  const auto blobs = std::move(*BlobStore::open(disk.folder, options));
  ASSERT_TRUE(blobs->begin(Upload1().digest, 290000));
  ASSERT_TRUE(write_file_atomic(dir.path() / "lightmap.exr", sample_payload(1, 100000)));
  const auto published = blobs->put_file(dir.path() / "lightmap.exr", 9);
  EXPECT_TRUE(published) << published.error().message;
}

TEST(Blobs, PublishingHasSpaceThatUploadsLeave) {
  const MemoryDir dir;
  SmallDisk disk;
  disk.folder = dir.path() / "blobs";
  disk.size = 300000;
  BlobOptions options;
  options.faults = &disk;
  options.keep_free = 150000;
  options.keep_free_publishing = 50000;
  const auto blobs = std::move(*BlobStore::open(disk.folder, options));
  const Bytes one = sample_payload(1, 100000), two = sample_payload(2, 100000);
  // Both are told that there is room, as there is; the second to send finds that there is none left.
  ASSERT_TRUE(blobs->begin(sha256(one), one.size()));
  ASSERT_TRUE(blobs->begin(sha256(two), two.size()));
  ASSERT_TRUE(blobs->append(sha256(one), 0, one));
  const Status full = blobs->append(sha256(two), 0, two);
  ASSERT_FALSE(full);
  EXPECT_EQ(full.error().kind, ErrorKind::kNoSpace);
  EXPECT_EQ(blobs->begin(sha256({}), 100000).error().kind, ErrorKind::kNoSpace);
  ASSERT_TRUE(write_file_atomic(dir.path() / "lightmap.exr", sample_payload(3, 100000)));
  EXPECT_TRUE(blobs->put_file(dir.path() / "lightmap.exr", 9));
  ASSERT_TRUE(write_file_atomic(dir.path() / "more.exr", sample_payload(4, 60000)));
  EXPECT_EQ(blobs->put_file(dir.path() / "more.exr", 9).error().kind, ErrorKind::kNoSpace);
  // What nobody goes on sending gives way.
  blobs->abandon(sha256(one));
  EXPECT_TRUE(blobs->put_file(dir.path() / "more.exr", 9));
  EXPECT_FALSE(fs::exists(blobs->path(sha256(one)).string() + ".part"));
}

TEST(Blobs, AnUploadWithoutNewBytesIsDroppedAndMayBeginAgain) {
  const MemoryDir dir;
  const Upload1 up;
  const auto blobs = open_blobs(dir.path());
  ASSERT_TRUE(blobs->begin(up.digest, up.bytes.size()));
  ASSERT_TRUE(blobs->append(up.digest, 0, up.part(0, 30000)));
  EXPECT_EQ(blobs->drop_idle(), 0u);  // it moved
  ASSERT_TRUE(blobs->append(up.digest, 30000, up.part(30000, 1)));
  EXPECT_EQ(blobs->drop_idle(), 0u);
  EXPECT_EQ(blobs->drop_idle(), 1u);
  EXPECT_EQ(blobs->drop_idle(), 0u);
  EXPECT_FALSE(fs::exists(blobs->path(up.digest).string() + ".part"));
  EXPECT_EQ(blobs->append(up.digest, 30001, up.part(30001, 1)).error().kind, ErrorKind::kUnavailable);
  EXPECT_EQ(blobs->finish(up.digest, 1).error().kind, ErrorKind::kUnavailable);
  EXPECT_EQ(*blobs->begin(up.digest, up.bytes.size()), 0u);
  ASSERT_TRUE(blobs->append(up.digest, 0, up.bytes));
  ASSERT_TRUE(blobs->finish(up.digest, 1));
  EXPECT_EQ(*read_file(blobs->path(up.digest)), up.bytes);
}

TEST(Blobs, ADamagedOneIsSetAsideAndMissingFromThenOn) {
  const MemoryDir dir;
  const Upload1 up;
  const auto blobs = open_blobs(dir.path());
  EXPECT_EQ(*blobs->verify(up.digest), BlobState::kMissing);
  put_bytes(*blobs, up.bytes, 1000);
  EXPECT_EQ(*blobs->verify(up.digest), BlobState::kIntact);
  flip_bit(blobs->path(up.digest));
  EXPECT_EQ(*blobs->verify(up.digest), BlobState::kDamaged);
  EXPECT_EQ(*blobs->verify(up.digest), BlobState::kMissing);
  EXPECT_FALSE(blobs->has(up.digest));
  EXPECT_TRUE(fs::exists(blobs->damaged_path(up.digest)));
  EXPECT_EQ(*blobs->begin(up.digest, up.bytes.size()), 0u);
  ASSERT_TRUE(blobs->append(up.digest, 0, up.bytes));
  ASSERT_TRUE(blobs->finish(up.digest, 1));
  EXPECT_EQ(*blobs->verify(up.digest), BlobState::kIntact);
  // It is kept for a month, for whoever looks into the disk.
  blobs->collect({up.digest}, 5000, 1000);
  EXPECT_TRUE(fs::exists(blobs->damaged_path(up.digest)));
  blobs->collect({up.digest}, int64_t{1} << 50, 1000);
  EXPECT_FALSE(fs::exists(blobs->damaged_path(up.digest)));
  EXPECT_TRUE(blobs->has(up.digest));
}

TEST(Blobs, AFileReplacesADamagedCopyOfItself) {
  const MemoryDir dir;
  const Upload1 up;
  ASSERT_TRUE(write_file_atomic(dir.path() / "scene.bin", up.bytes));
  const auto blobs = open_blobs(dir.path() / "blobs");
  ASSERT_TRUE(blobs->put_file(dir.path() / "scene.bin", 9));
  flip_bit(blobs->path(up.digest));
  ASSERT_TRUE(blobs->put_file(dir.path() / "scene.bin", 10));
  EXPECT_EQ(*read_file(blobs->path(up.digest)), up.bytes);
}

}  // namespace
}  // namespace kiln::test
