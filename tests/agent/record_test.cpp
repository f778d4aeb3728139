// A recorded conversation and its playing, with the worker's own program.
#include "common/base/files.h"
#include "tests/farm/worker_process.h"
#include "worker/agent/recording.h"

namespace kiln {
namespace {

using namespace test;
namespace fs = std::filesystem;

std::string words_of(const Bytes& bytes) {
  return {reinterpret_cast<const char*>(bytes.data()), bytes.size()};
}

// Units 1 to 5 of a job on two connections; unit 3 is answered on both.
void record(const std::string& file) {
  RawListener listener;
  const TestJob job;
  WorkerProcess worker(listener.port(), {"--record", file});
  auto first = listener.accept();
  ASSERT_TRUE(first && make_ready(*first, job));
  for (const uint64_t id : {1, 2, 3}) first->send(unit_of(job, id));
  for (const uint64_t id : {1, 2, 3}) {
    const auto result = first->next<Result>();
    ASSERT_TRUE(result);
    if (id < 3) first->send(CommitAck{job.spec.id, result->result.unit, result->digest});
  }
  first->close();
  auto second = listener.accept();
  ASSERT_TRUE(second && welcome(*second));
  second->send(Job{job.spec});
  const auto again = second->next<Result>();
  ASSERT_TRUE(again);
  EXPECT_EQ(again->result.unit, 3u);
  second->send(CommitAck{job.spec.id, 3, again->digest});
  for (const uint64_t id : {4, 5}) second->send(unit_of(job, id));
  for (int n = 0; n < 2; ++n) {
    const auto result = second->next<Result>();
    ASSERT_TRUE(result);
    second->send(CommitAck{job.spec.id, result->result.unit, result->digest});
  }
  second->send(Goodbye{"done"});
  ASSERT_TRUE(worker.ended_with(0));
}

CommandResult play(const std::string& file) {
  return run_command((binary_dir() / "bin/kiln-stub-worker").string() + " --play " + file);
}

TEST(Recording, PlaysWithTheSameDigestsAndWithoutACoordinator) {
  const TempDir dir;
  const std::string file = (dir.path() / "a.kilnrec").string();
  const StubOptions stub("");
  ASSERT_NO_FATAL_FAILURE(record(file));
  const auto good = play(file);
  EXPECT_EQ(good.exit_status, 0) << good.output;
  EXPECT_NE(good.output.find("of 2 connections: 5 answers are the same, 0 differ, 0 are missing"),
            std::string::npos)
      << good.output;
  const auto bytes = read_file(file);
  ASSERT_TRUE(bytes);
  const auto recording = read_recording(*bytes);
  ASSERT_TRUE(recording);
  size_t hellos = 0;
  for (const RecordedEvent& event : recording->events) {
    if (event.kind != Recorded::kSent) continue;
    const Message message = *message_of(event);
    const auto* hello = std::get_if<Hello>(&message);
    if (hello) EXPECT_EQ(hello->token, "");  // it was "token"
    hellos += hello != nullptr;
  }
  EXPECT_EQ(hellos, 2u);
}

TEST(Recording, NamesEveryAnswerThatDiffersOrIsMissing) {
  const TempDir dir;
  const std::string file = (dir.path() / "a.kilnrec").string();
  {
    const StubOptions stub("");
    ASSERT_NO_FATAL_FAILURE(record(file));
  }
  {
    const StubOptions stub("wrong=4;class=other");
    const auto bad = play(file);
    EXPECT_EQ(bad.exit_status, 1) << bad.output;
    EXPECT_NE(bad.output.find("unit 4 of job 77: digest "), std::string::npos) << bad.output;
    EXPECT_NE(bad.output.find("numeric class is other, then"), std::string::npos) << bad.output;
    EXPECT_NE(bad.output.find("4 answers are the same, 1 differ"), std::string::npos) << bad.output;
  }
  const StubOptions stub("fail=2");
  const auto failed = play(file);
  EXPECT_EQ(failed.exit_status, 1);
  EXPECT_NE(failed.output.find("unit 2 of job 77: no result now, then "), std::string::npos) << failed.output;
  EXPECT_NE(failed.output.find("1 are missing"), std::string::npos) << failed.output;
}

TEST(Recording, IsNeverOverwritten) {
  const TempDir dir;
  const std::string file = (dir.path() / "a.kilnrec").string();
  ASSERT_TRUE(write_file_atomic(file, std::string_view("mine")));
  WorkerProcess worker(1, {"--record", file});
  EXPECT_TRUE(worker.ended_with(2));
  EXPECT_EQ(words_of(*read_file(file)), "mine");
}

Bytes small_recording() {
  Bytes bytes = write_recording_head();
  for (const RecordedEvent& event : {RecordedEvent{Recorded::kOpened, 0, {}},
                                     {Recorded::kSent, 1, encode(Heartbeat{1, 2, 3})},
                                     {Recorded::kReceived, 2, encode(Pace{500})},
                                     {Recorded::kClosed, 3, Bytes(4, std::byte{'x'})}}) {
    const Bytes record = write_record(event);
    bytes.insert(bytes.end(), record.begin(), record.end());
  }
  return bytes;
}

TEST(Recording, EveryFlippedBitIsFoundAndEveryCutIsAnEnd) {
  const Bytes whole = small_recording();
  ASSERT_TRUE(read_recording(whole));
  EXPECT_EQ(read_recording(whole)->events.size(), 4u);
  for (size_t bit = 0; bit < whole.size() * 8; ++bit) {
    Bytes damaged = whole;
    damaged[bit / 8] ^= std::byte(1 << bit % 8);
    const auto read = read_recording(damaged);
    // A length that grew points beyond the end, as in a file that was cut.
    if (read) EXPECT_TRUE(read->cut && read->events.size() < 4) << "bit " << bit;
    if (!read) EXPECT_EQ(read.error().kind, ErrorKind::kInvalidInput);
  }
  size_t at_records = 0;
  for (size_t size = 8; size < whole.size(); ++size) {
    const auto read = read_recording(std::span(whole).first(size));
    ASSERT_TRUE(read) << size;
    at_records += !read->cut;
  }
  EXPECT_EQ(at_records, 4u);  // before each record
  EXPECT_FALSE(read_recording(std::span(whole).first(7)));
}

TEST(Recording, AFrameInARecordIsCheckedAsOneFromASocket) {
  const auto why = [](Bytes frame) {
    Bytes bytes = write_recording_head();
    const Bytes record = write_record({Recorded::kReceived, 1, std::move(frame)});
    bytes.insert(bytes.end(), record.begin(), record.end());
    const auto read = read_recording(bytes);
    return read ? std::string() : read.error().message;
  };
  EXPECT_EQ(why(encode(Pace{500})), "");
  EXPECT_NE(why(Bytes(3)).find("at byte 8: it holds no frame"), std::string::npos);
  Bytes frame = encode(Pace{500});
  frame.back() ^= std::byte{1};
  EXPECT_NE(why(frame).find("checksum"), std::string::npos);
  frame = encode(Pace{500});
  frame[2] = std::byte{1};
  EXPECT_NE(why(frame).find("install the same release"), std::string::npos);
}

}  // namespace
}  // namespace kiln
