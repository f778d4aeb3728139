#include "common/wire/messages.h"

#include <algorithm>
#include <random>
#include <set>

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

TEST(Messages, FieldsKeepTheirValues) {
  const auto messages = sample_messages();
  const auto hello = std::get<Hello>(*decode_frame(encode(messages[0])));
  EXPECT_EQ(hello.token, "secret");
  EXPECT_EQ(hello.instance, 34u);
  EXPECT_EQ(hello.engine, "embree 3");
  const auto request = std::get<ChunkRequest>(*decode_frame(encode(messages[7])));
  EXPECT_EQ(request.ids, std::get<ChunkRequest>(messages[7]).ids);
  const auto sent = std::find_if(messages.begin(), messages.end(),
                                 [](const Message& m) { return std::holds_alternative<Result>(m); });
  const auto result = std::get<Result>(*decode_frame(encode(*sent)));
  EXPECT_EQ(result.result.moments, std::get<Result>(*sent).result.moments);
  const auto credits = std::get<Credits>(*decode_frame(encode(messages[6])));
  EXPECT_EQ(credits.held, (std::vector<uint64_t>{5, 6}));
  const auto reply = std::get<Reply>(*decode_frame(encode(messages.back())));
  EXPECT_FALSE(reply.ok);
  EXPECT_EQ(reply.document, "no such job");
  EXPECT_EQ(result_digest(result.result), result.digest);
}

// A unit of neither is written as minor 1 writes it: an older worker reads it.
TEST(Messages, AUnitCarriesReplicateAndCacheWhereItHasThem) {
  const auto size = [](const Unit& unit) { return encode(unit).size(); };
  Digest cache;
  cache.bytes[31] = 1;
  const Unit plain{7, 11, {9, 64, 32, {1, 2, 3}}};
  Unit second = plain, cached = plain;
  second.unit.replicate = 1;
  cached.unit.cache = cache;
  EXPECT_EQ(size(plain), kFrameHeaderBytes + 3 * 8 + 2 * 4 + 8 + 3 * 4);
  EXPECT_FALSE(needs_minor_2(plain));
  for (const Unit& unit : {second, cached}) {
    EXPECT_TRUE(needs_minor_2(unit));
    EXPECT_EQ(size(unit), size(plain) + 4 + 32);
    const auto back = decode_frame(encode(unit));
    ASSERT_TRUE(back);
    const WorkUnit& read = std::get<Unit>(*back).unit;
    EXPECT_EQ(read.replicate, unit.unit.replicate);
    EXPECT_EQ(read.cache, unit.unit.cache);
    EXPECT_EQ(read.sites, unit.unit.sites);
  }
  cached.unit.replicate = kReplicates;
  EXPECT_FALSE(decode_frame(encode(cached)));
}

TEST(Messages, LongTextsAreCutAndStayBelowTheCap) {
  const std::string endless(1 << 20, 'y');
  Hello hello{endless, endless, endless, 1, 1, 1, endless, endless};
  const auto back = decode_frame(encode(hello));
  ASSERT_TRUE(back);
  EXPECT_EQ(std::get<Hello>(*back).token.size(), kMaxTextBytes);
  EXPECT_EQ(std::get<Refused>(*decode_frame(encode(Refused{endless}))).reason.size(), kMaxTextBytes);
}

TEST(Messages, AnotherMajorIsRefusedInWordsButMayRefuseUs) {
  for (const Message& message : sample_messages()) {
    Bytes frame = encode(message);
    frame[2] = std::byte{kWireMajor + 1};
    const auto back = decode_frame(frame);
    EXPECT_EQ(bool(back), std::holds_alternative<Refused>(message));
    if (!back) EXPECT_NE(back.error().message.find("same release"), std::string::npos);
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
    for (int round = 0; round < 4000; ++round) {
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
