#include <sys/stat.h>
#include <sys/wait.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <stdexcept>

#include "common/base/bytes.h"
#include "common/base/files.h"
#include "common/base/hash.h"
#include "common/base/json.h"
#include "common/base/log.h"
#include "common/base/loopback.h"
#include "common/base/parallel.h"
#include "common/base/printable.h"
#include "common/base/statistics.h"
#include "common/base/zeroed.h"

namespace kiln {
namespace {

TEST(Hash, Sha256OfAbc) {
  EXPECT_EQ(sha256(bytes_of("abc")).hex(),
            "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad");
  EXPECT_EQ(Digest::from_hex(sha256(bytes_of("abc")).hex())->hex(), sha256(bytes_of("abc")).hex());
  EXPECT_FALSE(Digest::from_hex("ab"));
}

TEST(Bytes, ReaderRefusesSizesBeforeAllocating) {
  ByteWriter w;
  w.put<uint64_t>(uint64_t{1} << 60);  // a count that would be 2^60 floats
  const Bytes bytes = w.take();
  ByteReader r(bytes);
  EXPECT_TRUE(r.get_array<float>().empty());
  EXPECT_FALSE(r.ok());
  EXPECT_EQ(r.get<uint32_t>(), 0u);
}

TEST(Bytes, RoundTrip) {
  ByteWriter w;
  w.put(1.5f);
  w.put_string("kiln");
  w.put_array(std::vector<int>{1, 2, 3});
  const Bytes bytes = w.take();
  ByteReader r(bytes);
  EXPECT_EQ(r.get<float>(), 1.5f);
  EXPECT_EQ(r.get_string(), "kiln");
  EXPECT_EQ(r.get_array<int>(), (std::vector<int>{1, 2, 3}));
  EXPECT_TRUE(r.at_end());
}

TEST(Files, AtomicWriteLeavesNothingBehindOnFailure) {
  test::TempDir dir;
  const auto path = dir.path() / "a.txt";
  ASSERT_TRUE(write_file_atomic(path, "one"));
  EXPECT_FALSE(write_atomic(path, [](const std::filesystem::path& temporary) -> Status {
    EXPECT_TRUE(write_file_atomic(temporary, "half"));
    return fail(ErrorKind::kIo, "no");
  }));
  EXPECT_EQ(read_file(path)->size(), 3u);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(dir.path()), {}), 1);
}

TEST(Files, BoundIsKept) {
  test::TempDir dir;
  ASSERT_TRUE(write_file_atomic(dir.path() / "a", "12345"));
  EXPECT_TRUE(read_file(dir.path() / "a", 5));
  EXPECT_FALSE(read_file(dir.path() / "a", 4));
}

TEST(Files, OnlyFilesAreRead) {
  test::TempDir dir;
  const auto message = [](const std::filesystem::path& path) { return read_file(path).error().message; };
  ASSERT_EQ(::mkfifo((dir.path() / "pipe").c_str(), 0600), 0);  // reading it would wait for ever
  EXPECT_NE(message(dir.path() / "pipe").find("pipe: it is a pipe, not a file"), std::string::npos);
  EXPECT_NE(message("/dev/zero").find("it is a device"), std::string::npos);
  EXPECT_NE(message(dir.path()).find("it is a folder"), std::string::npos);
  EXPECT_NE(message(dir.path() / "none").find("none: no such file"), std::string::npos);
  std::filesystem::create_symlink("loop", dir.path() / "loop");
  EXPECT_FALSE(read_file(dir.path() / "loop"));
}

TEST(Parallel, AnExceptionReachesTheCaller) {
  for (const unsigned threads : {1u, 4u}) {
    const auto broken = [&] {
      parallel_for(
          1000, [](size_t i) { i % 7 == 3 ? throw std::runtime_error("no more") : void(); }, threads);
    };
    EXPECT_THROW(broken(), std::runtime_error) << threads;
  }
}

TEST(Files, OutputFolderNeedsSpace) {
  test::TempDir dir;
  EXPECT_TRUE(prepare_output_folder(dir.path() / "new/deep", 1));
  const Status full = prepare_output_folder(dir.path(), uint64_t{1} << 60);
  ASSERT_FALSE(full);
  EXPECT_EQ(exit_status(full.error()), 2);
}

TEST(Json, WriterAndFlatReader) {
  JsonWriter w;
  w.begin_object()
      .pair("a", 1.5)
      .pair("b", "x\"y")
      .key("c")
      .begin_array()
      .value(1)
      .value(2)
      .end_array()
      .end_object();
  const auto flat = parse_flat_json(w.take());
  ASSERT_TRUE(flat);
  ASSERT_EQ(flat->size(), 3u);
  EXPECT_EQ((*flat)[1].second, "x\"y");
  EXPECT_EQ((*flat)[2].second, "1,2");
  EXPECT_FALSE(parse_flat_json("{\"a\": {\"b\": 1}}"));
  EXPECT_FALSE(parse_flat_json("{"));
}

TEST(Parallel, EveryIndexOnce) {
  std::vector<int> hits(1000, 0);
  parallel_for(hits.size(), [&](size_t i) { ++hits[i]; });
  for (int h : hits) EXPECT_EQ(h, 1);
}

// A few indices foretell the time of all. One of 36 that took a second alone stands for 18 turns of two
// threads.
TEST(Parallel, ForetellsTheTimeOfAllFromSome) {
  EXPECT_EQ(foretold_seconds(1.0, 1, 36, 2), 18.0);
  EXPECT_EQ(foretold_seconds(1.0, 2, 36, 2), 18.0);
  EXPECT_EQ(foretold_seconds(1.0, 3, 36, 2), 9.0);
  EXPECT_EQ(foretold_seconds(1.0, 1, 1, 8), 1.0);
  EXPECT_EQ(foretold_seconds(1.0, 0, 0, 2), 0.0);
}

TEST(Parallel, AllIndicesOrSomeIfTimeIsShort) {
  for (const size_t count : {0, 1, 3, 5, 36, 64, 1000, 100000}) {
    std::vector<int> hits(count);
    const auto hit = [&](size_t i) { ++hits[i]; };
    EXPECT_TRUE(parallel_for_within(1e9, count, hit, 2));
    EXPECT_EQ(std::count(hits.begin(), hits.end(), 1), static_cast<ptrdiff_t>(count));
    std::fill(hits.begin(), hits.end(), 0);
    if (count == 0) continue;
    EXPECT_FALSE(parallel_for_within(-1.0, count, hit, 2));
    const ptrdiff_t asked = std::count(hits.begin(), hits.end(), 1);
    EXPECT_GT(asked, 0);
    EXPECT_LE(asked, static_cast<ptrdiff_t>((count + 3) / 4));
  }
}

TEST(Statistics, NormalInterval) {
  EXPECT_NEAR(normal_interval(0.95), 1.9599639845400545, 1e-12);
  EXPECT_NEAR(normal_interval(0.6826894921370859), 1.0, 1e-12);
}

// Memory that was used before is handed out again: it has to be 0 all the same.
TEST(Zeroed, IsZeroInMemoryThatWasUsed) {
  for (const size_t size : {size_t{1}, size_t{100}, size_t{5000}, size_t{1} << 20}) {
    for (int round = 0; round < 3; ++round) {
      ZeroedVector<double> v(size);
      for (const double x : v) ASSERT_EQ(x, 0.0) << size;
      std::fill(v.begin(), v.end(), 3.0);
      const ZeroedVector<double> copy = v;
      ASSERT_EQ(copy, v);
    }
  }
}

TEST(Printable, IsOneLineThatSteersNothing) {
  EXPECT_EQ(printable("render7 is lost: 5 %"), "render7 is lost: 5 %");
  EXPECT_EQ(printable("Küche 台所 \xf0\x9f\x94\xa5 a\\b"), "Küche 台所 \xf0\x9f\x94\xa5 a\\b");
  EXPECT_EQ(printable("a\nkiln: error: b\r\tc"), "a\\nkiln: error: b\\r\\tc");
  EXPECT_EQ(printable("\x1b[2J\x7f"), "\\x1b[2J\\x7f");
  EXPECT_EQ(printable(std::string_view("\0", 1)), "\\x00");
  EXPECT_EQ(printable("\xc2\x9b"
                      "2J\xe2\x80\xa8\xe2\x80\xae"),
            "\\u{9b}2J\\u{2028}\\u{202e}");
  EXPECT_EQ(printable("\x9b\xff\xc3"), "\\x9b\\xff\\xc3") << "no UTF-8";
  EXPECT_EQ(printable("\xc0\x8a\xed\xa0\x80"), "\\xc0\\x8a\\xed\\xa0\\x80") << "long forms and surrogates";
}

TEST(Json, QuotesWhatATerminalObeys) {
  const std::string danger = "a\n\x1b\x7f\xc2\x9b\xc2\xa0\xc3\xa9";
  EXPECT_EQ(json_quote(danger), "\"a\\n\\u001b\\u007f\\u009b\xc2\xa0\xc3\xa9\"");
  EXPECT_EQ(parse_json(json_quote(danger))->text, danger);
  EXPECT_EQ(json_quote("\xc2"), "\"\xc2\"");
}

TEST(Log, LinesStayLines) {
  for (const LogFormat format : {LogFormat::kText, LogFormat::kJson}) {
    log_setup("kiln", LogLevel::kWarning, format);
    testing::internal::CaptureStderr();
    log_warning("job 'a\nkiln: error: all is lost' \x1b[31m\x7f\xc2\x9b");
    const std::string said = testing::internal::GetCapturedStderr();
    EXPECT_EQ(std::count(said.begin(), said.end(), '\n'), 1) << said;
    for (const char* danger : {"\x1b", "\x7f", "\xc2\x9b"}) EXPECT_EQ(said.find(danger), said.npos) << said;
    EXPECT_NE(said.find("all is lost' \\"), said.npos) << said;
  }
  log_setup("kiln", LogLevel::kWarning);
}

TEST(Loopback, IsAnAddressOfThisMachineOrExactlyLocalhost) {
  for (const char* host :
       {"localhost", "127.0.0.1", "127.0.0.53", "127.255.255.254", "::1", "0:0:0:0:0:0:0:1"})
    EXPECT_TRUE(is_loopback(host)) << host;
  for (const char* host : {"",
                           "127.evil.example",
                           "127.0.0.1.evil",
                           "127.0.0.1.evil.example",
                           "localhost.evil",
                           "localhost.",
                           "127.1",
                           "127.0.0.01",
                           "0127.0.0.1",
                           "2130706433",
                           "128.0.0.1",
                           "0.0.0.0",
                           "::",
                           "::2",
                           "[::1]",
                           "127.0.0.1 ",
                           " localhost",
                           "127.0.0.1:80",
                           "::1%lo",
                           "127."})
    EXPECT_FALSE(is_loopback(host)) << host;
  EXPECT_FALSE(is_loopback(std::string_view("127.0.0.1\0.evil", 15)));
  EXPECT_FALSE(is_loopback(std::string_view("localhost\0", 10)));
}

TEST(Loopback, InARequestOnlyAPortMayFollow) {
  for (const char* host :
       {"localhost", "localhost:80", "127.0.0.1:65535", "127.0.0.2", "[::1]", "[::1]:7801"})
    EXPECT_TRUE(is_loopback_authority(host)) << host;
  for (const char* host : {"",
                           ":80",
                           "127.evil.example",
                           "127.evil.example:80",
                           "[::1].evil.example",
                           "[::1].evil.example:80",
                           "127.0.0.1.evil",
                           "localhost.evil:80",
                           "localhost:",
                           "127.0.0.1:",
                           "[::1]:",
                           "localhost:80x",
                           "localhost:x",
                           "localhost:80:80",
                           "localhost:80/",
                           "localhost:65536",
                           "localhost:-1",
                           "localhost:+1",
                           "localhost: 80",
                           "[::1",
                           "[::1]80",
                           "[127.0.0.1]",
                           "[localhost]",
                           "[]",
                           "::1",
                           "::1:80",
                           "evil@localhost",
                           "localhost@evil",
                           "localhost,evil"})
    EXPECT_FALSE(is_loopback_authority(host)) << host;
}

}  // namespace
// In a control group of our own, where this machine lets us make one (v1 or v2).
TEST(Memory, IsThatOfTheControlGroup) {
  constexpr uint64_t kLimit = uint64_t{512} << 20;
  struct Group {
    std::filesystem::path folder;
    const char* file;
  };
  const std::string name = "kiln-test-" + std::to_string(::getpid());
  std::error_code failed;
  for (const Group& group : {Group{"/sys/fs/cgroup/memory/" + name, "memory.limit_in_bytes"},
                             Group{"/sys/fs/cgroup/" + name, "memory.max"}}) {
    if (!std::filesystem::create_directory(group.folder, failed)) continue;
    if (std::filesystem::exists(group.folder / group.file) &&
        (std::ofstream(group.folder / group.file) << kLimit).flush()) {
      const pid_t child = ::fork();
      if (child == 0) {
        const bool in = bool((std::ofstream(group.folder / "cgroup.procs") << ::getpid()).flush());
        ::_exit(!in ? 2 : memory_bytes() == kLimit ? 0 : 1);
      }
      int status = 0;
      ::waitpid(child, &status, 0);
      std::filesystem::remove(group.folder, failed);
      ASSERT_TRUE(WIFEXITED(status));
      if (WEXITSTATUS(status) == 2) continue;
      EXPECT_EQ(WEXITSTATUS(status), 0);
      return;
    }
    std::filesystem::remove(group.folder, failed);
  }
  GTEST_SKIP() << "no rights to make a control group";
}

}  // namespace kiln
