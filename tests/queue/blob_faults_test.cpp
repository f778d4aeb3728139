// The blob store on a disk that fails, and among files that are not its own.
#include <fcntl.h>

#include <cerrno>

#include "common/base/files.h"
#include "coordinator/farm/queue/blobs.h"
#include "tests/queue/samples.h"

namespace kiln::test {
namespace {
namespace fs = std::filesystem;

// Fails, or calls back, where it is told to.
struct HookedDisk final : DiskCalls {
  int interrupted = 0;         // so many writes are interrupted by a signal
  bool no_truncate = false;    // truncations fail
  int free_answers = 1 << 20;  // the free space is known so many times more
  uint64_t free = uint64_t{1} << 40;
  std::function<void()> on_sync;  // once

  ssize_t write_at(int file, const void* data, size_t size, off_t offset) override {
    if (interrupted-- > 0) return errno = EINTR, -1;
    return DiskCalls::write_at(file, data, size, offset);
  }
  int sync(int file) override {
    if (const auto hook = std::exchange(on_sync, nullptr)) hook();
    return DiskCalls::sync(file);
  }
  int truncate(int file, off_t size) override {
    if (no_truncate) return errno = EIO, -1;
    return DiskCalls::truncate(file, size);
  }
  int free_bytes(const char*, uint64_t& bytes) override {
    if (free_answers-- <= 0) return errno = EIO, -1;
    bytes = free;
    return 0;
  }
};

struct Blobs {
  MemoryDir dir;
  HookedDisk disk;
  std::unique_ptr<BlobStore> store;
  Bytes bytes = sample_payload(5, 1000);
  Digest digest = sha256(bytes);

  explicit Blobs(BlobOptions options = {}) {
    options.faults = &disk;
    store = std::move(*BlobStore::open(folder(), options));
  }
  fs::path folder() const { return dir.path() / "blobs"; }
  fs::path path() const { return store->path(digest); }
  fs::path part() const { return path().string() + ".part"; }
  void send_all() {
    ASSERT_TRUE(store->begin(digest, bytes.size()));
    ASSERT_TRUE(store->append(digest, 0, bytes));
  }
  void put() {
    send_all();
    ASSERT_TRUE(store->finish(digest, 1));
  }
  void expect_error(const Status& status, ErrorKind kind, const char* words) {
    ASSERT_FALSE(status) << words;
    EXPECT_EQ(status.error().kind, kind) << words;
    EXPECT_NE(status.error().message.find(words), std::string::npos) << status.error().message;
  }
  template <class T>
  void expect_error(const Expected<T>& result, ErrorKind kind, const char* words) {
    expect_error(result ? Status() : Status(tl::unexpected<Error>(result.error())), kind, words);
  }
};

TEST(BlobFaults, ASignalInterruptsNothing) {
  Blobs b;
  b.disk.interrupted = 3;
  b.put();
  EXPECT_EQ(*read_file(b.path()), b.bytes);
}

TEST(BlobFaults, TheFreeSpaceIsNotKnown) {
  Blobs b;
  b.disk.free_answers = 0;
  b.expect_error(b.store->begin(b.digest, 1000), ErrorKind::kIo, "free space");
  // While abandoned uploads are looked through.
  b.disk.free_answers = 1 << 20;
  b.send_all();
  b.store->abandon(b.digest);
  b.disk.free = 0;
  b.disk.free_answers = 1;
  b.expect_error(b.store->begin(sha256({}), 1000), ErrorKind::kIo, "free space");
  EXPECT_TRUE(fs::exists(b.part())) << "nothing is removed for a space that nobody knows";
}

TEST(BlobFaults, ASizeThatOverflowsIsMoreThanThereIs) {
  BlobOptions options;
  options.blob_bytes = ~uint64_t{0};
  Blobs b(options);
  b.disk.free = ~uint64_t{0} - 1;
  b.expect_error(b.store->begin(b.digest, ~uint64_t{0}), ErrorKind::kNoSpace, "are needed");
}

TEST(BlobFaults, OnlyAbandonedUploadsMakeRoom) {
  Blobs b;
  b.put();
  const Digest sent = sha256(bytes_of("sent"));
  ASSERT_TRUE(b.store->begin(sent, 10));
  const fs::path folder = b.path().parent_path();
  const std::string other = b.digest.hex().substr(0, 63) + (b.digest.hex().back() == '0' ? '1' : '0');
  ASSERT_TRUE(write_file_atomic(folder / "notes.part", std::string_view("somebody's")));
  fs::create_symlink("nowhere", folder / (other + ".part"));
  const Digest stuck = sha256(bytes_of("stuck"));
  fs::create_directories(b.store->path(stuck).string() + ".part/x");
  b.disk.free = 0;
  b.expect_error(b.store->begin(sha256({}), 10), ErrorKind::kNoSpace, "are needed");
  EXPECT_TRUE(b.store->has(b.digest));
  EXPECT_TRUE(fs::exists(folder / "notes.part"));
  EXPECT_TRUE(fs::exists(b.store->path(sent).string() + ".part"));
}

TEST(BlobFaults, AnUploadThatLiedAboutItsSizeBeginsAnew) {
  Blobs b;
  b.send_all();
  b.store->abandon(b.digest);
  b.disk.no_truncate = true;
  b.expect_error(b.store->begin(b.digest, 999), ErrorKind::kIo, "cannot shorten");
  b.disk.no_truncate = false;
  EXPECT_EQ(*b.store->begin(b.digest, 999), 0u);
  EXPECT_EQ(fs::file_size(b.part()), 0u);
}

TEST(BlobFaults, ABlobThatIsThereHasItsSize) {
  Blobs b;
  b.put();
  b.expect_error(b.store->begin(b.digest, 999), ErrorKind::kInvalidInput, "has 1000 bytes, not 999");
  EXPECT_TRUE(b.store->append(b.digest, 0, b.bytes)) << "a client that came too late";
  EXPECT_EQ(*b.store->size(b.digest), 1000u);
  b.expect_error(b.store->size(sha256({})), ErrorKind::kInvalidInput, "there is no blob");
}

TEST(BlobFaults, AFileThatVanishesIsAnError) {
  Blobs b;
  fs::create_directories(b.part());
  b.expect_error(b.store->begin(b.digest, 1000), ErrorKind::kIo, "cannot create");
  fs::remove(b.part());
  ASSERT_TRUE(b.store->begin(b.digest, 1000));
  fs::remove(b.part());
  b.expect_error(b.store->append(b.digest, 0, b.bytes), ErrorKind::kIo, "cannot open");
  b.store->abandon(b.digest);
  b.send_all();
  fs::remove(b.part());
  b.expect_error(b.store->finish(b.digest, 1), ErrorKind::kIo, "cannot open");
  EXPECT_TRUE(write_file_atomic(b.part(), b.bytes));
  EXPECT_TRUE(b.store->finish(b.digest, 1)) << "it may be tried again";
}

TEST(BlobFaults, ANameThatIsTakenByAFolderIsAnError) {
  Blobs b;
  fs::create_directories(b.path() / "x");
  b.send_all();
  b.expect_error(b.store->finish(b.digest, 1), ErrorKind::kIo, "cannot name");
}

// Verification of a large file takes long, and its other senders go on talking meanwhile.
TEST(BlobFaults, WhileItIsVerifiedOthersAreToldToWait) {
  Blobs b;
  b.send_all();
  bool asked = false;
  b.disk.on_sync = [&] {
    asked = true;
    EXPECT_TRUE(b.store->append(b.digest, 0, b.bytes));
    b.expect_error(b.store->finish(b.digest, 2), ErrorKind::kUnavailable, "is being verified");
    b.store->abandon(b.digest);
    EXPECT_EQ(b.store->drop_idle(), 0u);
    EXPECT_EQ(b.store->drop_idle(), 0u);
  };
  ASSERT_TRUE(b.store->finish(b.digest, 1));
  EXPECT_TRUE(asked);
  EXPECT_TRUE(b.store->has(b.digest));
}

TEST(BlobFaults, AnUploadEndsWithItsLastSender) {
  Blobs b;
  ASSERT_TRUE(b.store->begin(b.digest, 1000));
  ASSERT_TRUE(b.store->begin(b.digest, 1000));
  b.store->abandon(b.digest);
  EXPECT_TRUE(b.store->append(b.digest, 0, b.bytes));
  b.store->abandon(b.digest);
  EXPECT_FALSE(b.store->append(b.digest, 1000, b.bytes));
  b.store->abandon(b.digest);  // once more than there were
  EXPECT_EQ(*b.store->begin(b.digest, 1000), 1000u);
}

TEST(BlobFaults, VerifyingEndsWhenItsPaceSaysSo) {
  Blobs b;
  b.put();
  const auto pace = [](uint64_t) { return false; };
  b.expect_error(b.store->verify(b.digest, pace), ErrorKind::kUnavailable, "was not read to its end");
  EXPECT_TRUE(b.store->has(b.digest));
  const OpenFile file(b.path(), O_RDONLY);
  b.expect_error(hash_file(file, pace), ErrorKind::kUnavailable, "was not read to its end");
  EXPECT_EQ(hash_file(file, [](uint64_t bytes) { return bytes == 1000; })->digest, b.digest);
}

// Another thread puts the right file in its place before the damaged one is set aside.
TEST(BlobFaults, AReplacementIsNotSetAsideForWhatItReplaced) {
  Blobs b;
  b.put();
  flip_bit(b.path());
  const auto state = b.store->verify(b.digest, [&](uint64_t) {
    EXPECT_TRUE(write_file_atomic(b.path(), b.bytes));
    return true;
  });
  EXPECT_EQ(*state, BlobState::kDamaged);
  EXPECT_EQ(*read_file(b.path()), b.bytes);
  EXPECT_EQ(b.store->verified().damaged, 0u);
  flip_bit(b.path());
  EXPECT_EQ(*b.store->verify(b.digest, [&](uint64_t) { return fs::remove(b.path()); }), BlobState::kDamaged);
  EXPECT_EQ(b.store->verified().damaged, 0u) << "it has gone already";
}

TEST(BlobFaults, WhatCannotBeReadIsDamagedAndWhatCannotBeOpenedAnError) {
  Blobs b;
  fs::create_directories(b.path());
  EXPECT_EQ(*b.store->verify(b.digest), BlobState::kDamaged) << "reading a folder fails";
  EXPECT_TRUE(fs::is_directory(b.store->damaged_path(b.digest)));
  EXPECT_EQ(*b.store->verify(b.digest), BlobState::kMissing);
  fs::remove(b.path().parent_path());
  ASSERT_TRUE(write_file_atomic(b.path().parent_path(), std::string_view("a file where a folder should be")));
  b.expect_error(b.store->verify(b.digest), ErrorKind::kIo, "cannot open");
}

TEST(BlobFaults, ADamagedOneThatCannotBeSetAsideIsRemoved) {
  Blobs b;
  b.put();
  flip_bit(b.path());
  ASSERT_TRUE(write_file_atomic(b.folder() / "damaged", std::string_view("a file where a folder should be")));
  EXPECT_EQ(*b.store->verify(b.digest), BlobState::kDamaged);
  EXPECT_FALSE(b.store->has(b.digest));
}

TEST(BlobFaults, AFileThatCannotBePutSaysWhy) {
  BlobOptions options;
  options.blob_bytes = 999;
  Blobs b(options);
  ASSERT_TRUE(write_file_atomic(b.dir.path() / "large", b.bytes));
  b.expect_error(b.store->put_file(b.dir.path() / "large", 1), ErrorKind::kInvalidInput, "999 are allowed");
  b.expect_error(b.store->put_file(b.dir.path(), 1), ErrorKind::kIo, "cannot read");
  ASSERT_TRUE(write_file_atomic(b.dir.path() / "small", std::string_view("x")));
  fs::create_directory(b.folder() / "1.copy");
  b.expect_error(b.store->put_file(b.dir.path() / "small", 1), ErrorKind::kIo, "cannot create");
  // One that grows while it is copied.
  const OpenFile in(b.dir.path() / "large", O_RDONLY), out(b.dir.path() / "out", O_WRONLY | O_CREAT);
  b.expect_error(copy_file(in, out, b.disk, 999), ErrorKind::kInvalidInput, "more than 999 bytes");
  EXPECT_EQ(copy_file(in, out, b.disk, 1000)->size, 1000u);
}

TEST(BlobFaults, CopiesOfAnEarlierProcessGoAtTheOpening) {
  Blobs b;
  b.put();
  ASSERT_TRUE(write_file_atomic(b.folder() / "7.copy", std::string_view("half")));
  ASSERT_TRUE(write_file_atomic(b.folder() / "notes", std::string_view("somebody's")));
  const auto again = BlobStore::open(b.folder(), {});
  EXPECT_FALSE(fs::exists(b.folder() / "7.copy"));
  EXPECT_TRUE(fs::exists(b.folder() / "notes"));
  EXPECT_TRUE((*again)->has(b.digest));
}

TEST(BlobFaults, StrangersAreNotCollected) {
  Blobs b;
  b.put();
  const fs::path folder = b.path().parent_path();
  const std::string other = b.digest.hex().substr(0, 63) + (b.digest.hex().back() == '0' ? '1' : '0');
  ASSERT_TRUE(write_file_atomic(folder / "notes", std::string_view("somebody's")));
  fs::create_directory(folder / other);
  fs::create_directory(b.folder() / "damaged");
  fs::create_symlink("nowhere", b.folder() / "damaged" / other);
  const int64_t far = int64_t{1} << 50;
  EXPECT_EQ(b.store->collect({}, far, 1).blobs, 1u);
  EXPECT_TRUE(fs::exists(folder / "notes"));
  EXPECT_TRUE(fs::exists(folder / other));
  EXPECT_TRUE(fs::is_symlink(b.folder() / "damaged" / other));
  EXPECT_FALSE(b.store->has(b.digest));
}

TEST(BlobFaults, AFileIsRecognisedByItsPlaceOnTheDisk) {
  const MemoryDir dir;
  const fs::path a = dir.path() / "a", b = dir.path() / "b";
  ASSERT_TRUE(write_file_atomic(a, std::string_view("x")));
  ASSERT_TRUE(write_file_atomic(b, std::string_view("x")));
  const OpenFile file(a, O_RDONLY);
  EXPECT_TRUE(is_file_at(file, a));
  EXPECT_FALSE(is_file_at(file, b));
  EXPECT_FALSE(is_file_at(file, dir.path() / "gone"));
  EXPECT_FALSE(is_file_at(file, "/proc/self/status")) << "another file system";
  EXPECT_FALSE(is_file_at(OpenFile(dir.path() / "gone", O_RDONLY), a));
  EXPECT_FALSE(last_use(dir.path() / "gone"));
  EXPECT_FALSE(set_last_use(dir.path() / "gone", 5));
  ASSERT_TRUE(set_last_use(a, 12345));
  EXPECT_EQ(last_use(a), 12345);
}

}  // namespace
}  // namespace kiln::test
