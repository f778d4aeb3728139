#include "common/wire/messages.h"

#include <algorithm>
#include <random>
#include <set>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/wire/limits.h"
#include "common/zstd/compress.h"
#include "tests/wire/samples.h"

namespace kiln {
namespace {

using test::decode_frame;
using test::sample_messages;

TEST(Messages, EveryTypeSurvivesARoundTrip) {
  std::set<size_t> types;
  for (const Message& message : sample_messages()) {
    const Bytes frame = encode(message);
    const auto back = decode_frame(frame);
    ASSERT_TRUE(back) << message.index() << ": " << back.error().message;
    ASSERT_EQ(back->index(), message.index());
    EXPECT_EQ(encode(*back), frame) << message.index();
    types.insert(message.index());
  }
  EXPECT_EQ(types.size(), std::variant_size_v<Message>);
}

template <class M>
M round_trip(const M& message) {
  return std::get<M>(*decode_frame(encode(message)));
}

Digest some_digest() {
  Digest d;
  for (size_t i = 0; i < d.bytes.size(); ++i) d.bytes[i] = static_cast<uint8_t>(i * 7);
  return d;
}

UnitResult some_result() {
  UnitResult r;
  r.unit = 9, r.site_count = 2, r.plane_count = 3;
  r.moments = {1.5, -2.0, 1e300, 0.0, 4.0, 1e-300};
  r.rays = 1000, r.nonfinite = 1, r.nonfinite_texel = 5, r.nonfinite_sample = 6, r.seconds = 0.25;
  return r;
}

TEST(Messages, FieldsKeepTheirValues) {
  const auto hello = round_trip(Hello{"0.1.0", "secret", "host", 12, 34, 5, "avx2", "embree 3"});
  EXPECT_EQ(hello.token, "secret");
  EXPECT_EQ(hello.instance, 34u);
  EXPECT_EQ(hello.engine, "embree 3");
  const std::vector<Digest> ids{some_digest(), Digest{}, some_digest()};
  EXPECT_EQ(round_trip(ChunkRequest{ids, true}).ids, ids);
  EXPECT_EQ(round_trip(Credits{7, 4, {5, 6}}).held, (std::vector<uint64_t>{5, 6}));
  const UnitResult r = some_result();
  const auto result = round_trip(Result{7, 11, r, result_digest(r), 12});
  EXPECT_EQ(result.result.moments, r.moments);
  EXPECT_EQ(result_digest(result.result), result.digest);
  const auto reply = round_trip(Reply{1, false, ErrorKind::kUsage, "no such job"});
  EXPECT_FALSE(reply.ok);
  EXPECT_EQ(reply.document, "no such job");
  const Unit unit = round_trip(Unit{7, 11, {9, 64, 32, {1, 2, 3}, 1, some_digest()}});
  EXPECT_EQ(unit.unit.replicate, 1u);
  EXPECT_EQ(unit.unit.cache, some_digest());
  EXPECT_EQ(unit.unit.sites, (std::vector<uint32_t>{1, 2, 3}));
  EXPECT_EQ(round_trip(Unit{7, 11, {9, 64, 32, {1}, 1, some_digest(), 5}}).unit.take, 5u);
  for (const bool compress : {false, true}) {
    const auto piece = round_trip(ChunkPiece{some_digest(), 10, 6000, Bytes(5000, std::byte{3}), compress});
    EXPECT_EQ(piece.compress, compress);
    EXPECT_EQ(piece.bytes, Bytes(5000, std::byte{3}));
  }
}

// What is hashed or stored in data folders keeps its bytes from release to release.
TEST(Messages, StoredBytesAndDigestsAreThoseOfEarlierReleases) {
  EXPECT_EQ(sha256(write_result(some_result())).hex(),
            "b84550880e463c765914fc707b1d9b7e04067e56c8b05c70f2a6c0eccc0e8dd5");
  EXPECT_EQ(result_digest(some_result()).hex(),
            "03287cd9101d681268f15b37619693daa6991f8c84e2f6222f65acd48fcd0067");
  EXPECT_EQ(unit_shape({9, 64, 32, {1, 2, 3}, 1, some_digest()}), 17838075707943987571u);
  EXPECT_NE(unit_shape({9, 64, 32, {1, 2, 3}, 1, some_digest(), 1}), 17838075707943987571u);
}

TEST(Messages, BytesAfterTheLastFieldAreRefused) {
  Bytes frame = encode(Heartbeat{1, 2, 3});
  frame.push_back(std::byte{0});
  seal_frame(Heartbeat::kKind.type, frame);
  const auto back = decode_frame(frame);
  ASSERT_FALSE(back);
  EXPECT_NE(back.error().message.find("1 bytes follow its last field"), std::string::npos)
      << back.error().message;
}

// One wrong value at a time, each refused by its field's own rule.
TEST(Messages, ValuesOutOfRangeAreRefusedByName) {
  const auto why = [](const Message& message) {
    const auto back = decode_frame(encode(message));
    return back ? std::string() : back.error().message;
  };
  const auto says = [&](const Message& message, const char* words) {
    EXPECT_NE(why(message).find(words), std::string::npos) << why(message);
  };
  says(Pace{0}, "a Pace message is damaged at field 1: its interval");
  says(Welcome{1, 0, 2}, "interval");
  says(Unit{7, 11, {9, 64, 32, {1}, kReplicates}}, "replicate");
  UnitResult r = some_result();
  r.moments.pop_back();
  says(Result{7, 11, r, {}, 12}, "moments");
  says(JobFailed{7, static_cast<ErrorKind>(200), "x"}, "kind of error 200 does not exist");
  says(ChunkRequest{std::vector<Digest>(kMaxIdsPerRequest + 1), false}, "its size is 1025, of 1024 at most");
  says(Request{1, "jobs", std::string(kMaxDocumentBytes + 1, ' ')}, "at most");
  JobSpec job{7, {}, {}, {}};
  EXPECT_EQ(why(Job{job}), "");
  job.transport.quantities.light = false;
  says(Job{job}, "no quantity at all");
  job.transport.quantities.all_light = true;
  says(Job{job}, "without light");
  job.transport.quantities = {};
  job.transport.quantities.responses = {1, 0};
  says(Job{job}, "a quantity that does not exist");
  job.transport.quantities = {};
  job.transport.quantities.probe_visibility = true;
  says(Job{job}, "without probes");
  job.transport.quantities.probes = true;
  says(Job{job}, "what probes do not have");
  job.transport.basis = *find_basis("sh_l2");
  EXPECT_EQ(why(Job{job}), "");
}

// A count is believed only as far as its elements follow.
TEST(Messages, AnAnnouncedArrayTakesNoMemoryBeforeItsElementsAreThere) {
  Bytes frame = encode(Withdraw{7, {8, 9}});
  const uint64_t lie = uint64_t{1} << 60;
  std::memcpy(frame.data() + kFrameHeaderBytes + 8, &lie, 8);
  seal_frame(Withdraw::kKind.type, frame);
  const auto back = decode_frame(frame);
  ASSERT_FALSE(back);
  EXPECT_NE(back.error().message.find("are announced and do not follow"), std::string::npos);
}

TEST(Messages, TheDocumentsTableNamesEveryType) {
  const auto page = read_file(test::source_dir() / "docs/wire-format.md");
  ASSERT_TRUE(page);
  const std::string_view words(reinterpret_cast<const char*>(page->data()), page->size());
  for (const Message& message : sample_messages())
    std::visit(
        [&](const auto& m) {
          const std::string row = text("\n| {} | {} |", static_cast<uint16_t>(m.kKind.type), m.kKind.name);
          EXPECT_NE(words.find(row), std::string_view::npos) << row;
        },
        message);
}

TEST(Messages, LongTextsAreCutAndStayBelowTheCap) {
  const std::string endless(1 << 20, 'y');
  Hello hello{endless, endless, endless, 1, 1, 1, endless, endless};
  const auto back = decode_frame(encode(hello));
  ASSERT_TRUE(back);
  EXPECT_EQ(std::get<Hello>(*back).token.size(), kMaxTextBytes);
  EXPECT_EQ(std::get<Refused>(*decode_frame(encode(Refused{endless}))).reason.size(), kMaxTextBytes);
}

TEST(Messages, AnotherVersionIsRefusedInWordsButMayRefuseUs) {
  for (const Message& message : sample_messages()) {
    Bytes frame = encode(message);
    frame[2] = std::byte{kWireVersion + 1};
    const auto back = decode_frame(frame);
    EXPECT_EQ(bool(back), std::holds_alternative<Refused>(message));
    if (!back) EXPECT_NE(back.error().message.find("same release"), std::string::npos);
  }
}

TEST(Messages, ReservedBytesOfTheHeadMustBeZero) {
  for (const size_t byte : {3u, 6u, 7u}) {
    Bytes frame = encode(Pace{500});
    frame[byte] = std::byte{1};
    EXPECT_FALSE(decode_frame(frame)) << byte;
  }
}

// Damage that a checksum would stop, so that the decoders behind it are on their own.
TEST(Messages, DamagedPayloadsFailAndNeverCrash) {
  std::mt19937 random(20240817);
  size_t refused = 0;
  for (const Message& message : sample_messages()) {
    const Bytes frame = encode(message);
    const auto header = *read_frame_header(std::span(frame).first<kFrameHeaderBytes>());
    const Bytes original(frame.begin() + kFrameHeaderBytes, frame.end());
    for (int round = 0; round < 1500; ++round) {
      Bytes payload = original;
      if (round % 4 == 0 && !payload.empty()) payload.resize(random() % payload.size());
      if (round % 7 == 0) payload.resize(payload.size() + random() % 64, std::byte(random() & 255));
      const int changes = round % 5 == 0 ? 20 : 2;
      for (int k = 0; k < changes && !payload.empty(); ++k) {
        // Heads hold the offsets and counts: hit them more often.
        const size_t span = random() % 2 ? payload.size() : std::min<size_t>(payload.size(), 64);
        payload[random() % span] = std::byte(random() & 255);
      }
      const auto back = decode(header, payload);
      if (!back) {
        ++refused;
        EXPECT_EQ(back.error().kind, ErrorKind::kProtocol);
      } else {
        (void)encode(*back);  // what was accepted is within every cap
      }
    }
  }
  EXPECT_GT(refused, 1000u);
}

TEST(Messages, AChunkPieceMustFitItsChunk) {
  const auto read = [](ChunkPiece piece) { return bool(decode_frame(encode(piece))); };
  EXPECT_TRUE(read({{}, 0, 4, Bytes(4), false}));
  EXPECT_FALSE(read({{}, 1, 4, Bytes(4), false}));
  EXPECT_FALSE(read({{}, ~0ull - 1, 4, Bytes(4), false}));
  EXPECT_FALSE(read({{}, 0, kMaxChunkBytes + 1, Bytes(4), false}));
  EXPECT_TRUE(read({{}, 0, kChunkPieceBytes, Bytes(kChunkPieceBytes), true}));
  EXPECT_FALSE(read({{}, 0, kChunkPieceBytes + 1, Bytes(kChunkPieceBytes + 1), true}));
}

TEST(Compress, UnpacksOnlyToTheStatedSize) {
  const Bytes zeros(1 << 20);
  const Bytes packed = compress(zeros);
  EXPECT_LT(packed.size(), 1000u);
  EXPECT_TRUE(decompress(packed, zeros.size()));
  EXPECT_FALSE(decompress(packed, zeros.size() - 1));
  EXPECT_FALSE(decompress(packed, zeros.size() + 1));
  EXPECT_FALSE(decompress(packed, 0));
}

}  // namespace
}  // namespace kiln
