#include "common/wire/messages.h"

#include <algorithm>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/wire/blocks.h"
#include "common/wire/limits.h"
#include "common/wire/messages_generated.h"

namespace kiln {
namespace {

namespace fb = flatbuffers;
using Builder = fb::FlatBufferBuilder;
using Payload = std::span<const std::byte>;
using blocks::write;

fb::Offset<fb::String> put(Builder& b, std::string_view s) {
  return b.CreateString(s.data(), std::min(s.size(), kMaxTextBytes));
}
fb::Offset<fb::Vector<uint8_t>> put(Builder& b, Payload bytes) {
  return b.CreateVector(reinterpret_cast<const uint8_t*>(bytes.data()), bytes.size());
}

template <class Offset>
Bytes finish(Builder& b, Offset root) {
  b.Finish(root);
  Bytes frame(kFrameHeaderBytes + b.GetSize());
  std::memcpy(frame.data() + kFrameHeaderBytes, b.GetBufferPointer(), b.GetSize());
  return frame;
}

Bytes write(const Hello& m) {
  Builder b;
  const auto version = put(b, m.version), token = put(b, m.token), host = put(b, m.host);
  const auto isa = put(b, m.isa), engine = put(b, m.engine);
  return finish(b, schema::CreateHello(b, version, token, host, m.pid, m.instance, m.threads, isa, engine));
}
Bytes write(const Welcome& m) {
  Builder b;
  return finish(b, schema::CreateWelcome(b, m.worker, m.heartbeat_ms, m.lease_ms));
}
Bytes write(const Refused& m) {
  const size_t size = std::min(m.reason.size(), kMaxTextBytes);
  Bytes frame(kFrameHeaderBytes + size);
  std::memcpy(frame.data() + kFrameHeaderBytes, m.reason.data(), size);
  return frame;
}
Bytes write(const Job& m) {
  Builder b;
  return finish(b, schema::CreateJob(b, put(b, m.spec)));
}
Bytes write(const JobClass& m) {
  Builder b;
  return finish(b, schema::CreateJobClass(b, m.job, put(b, m.numeric_class)));
}
Bytes write(const JobFailed& m) {
  Builder b;
  return finish(b, schema::CreateJobFailed(b, m.job, static_cast<uint8_t>(m.kind), put(b, m.reason)));
}
Bytes write(const Credits& m) {
  Builder b;
  return finish(b, schema::CreateCredits(b, m.job, m.units, b.CreateVector(m.held)));
}
Bytes write(const ChunkRequest& m) {
  Builder b;
  return finish(b, schema::CreateChunkRequest(b, put(b, bytes_of(m.ids)), m.compress));
}
Bytes write(const UnitFailed& m) {
  Builder b;
  return finish(
      b, schema::CreateUnitFailed(b, m.job, m.unit, m.lease, static_cast<uint8_t>(m.kind), put(b, m.reason)));
}
Bytes write(const CommitAck& m) {
  Builder b;
  return finish(b,
                schema::CreateCommitAck(b, m.job, m.unit, put(b, std::as_bytes(std::span(m.digest.bytes)))));
}
Bytes write(const Heartbeat& m) {
  Builder b;
  return finish(b, schema::CreateHeartbeat(b, m.running, m.queued, m.oldest_ms));
}
Bytes write(const Drain& m) {
  Builder b;
  const auto units = b.CreateVector(m.units);
  return finish(b, schema::CreateDrain(b, units, put(b, m.reason)));
}
Bytes write(const Goodbye& m) {
  Builder b;
  return finish(b, schema::CreateGoodbye(b, put(b, m.reason)));
}

Bytes write(const Withdraw& m) {
  Builder b;
  return finish(b, schema::CreateWithdraw(b, m.job, b.CreateVector(m.units)));
}
Bytes write(const JobEnded& m) {
  Builder b;
  return finish(b, schema::CreateJobEnded(b, m.job, put(b, m.reason)));
}
Bytes write(const Pace& m) {
  Builder b;
  return finish(b, schema::CreatePace(b, m.heartbeat_ms));
}
Bytes write(const ClientHello& m) {
  Builder b;
  const auto version = put(b, m.version), token = put(b, m.token), user = put(b, m.user);
  return finish(b, schema::CreateClientHello(b, version, token, user, put(b, m.host)));
}
Bytes write(const ClientWelcome& m) {
  Builder b;
  const auto version = put(b, m.version);
  return finish(b, schema::CreateClientWelcome(b, version, put(b, m.role)));
}

std::string get(const fb::String* s) {
  return s ? s->str() : std::string();
}

template <class T>
std::vector<T> get_records(const fb::Vector<uint8_t>* v, bool& ok) {
  std::vector<T> records;
  if (!v) return records;
  if (v->size() % sizeof(T)) ok = false;
  records.resize(v->size() / sizeof(T));
  if (!records.empty()) std::memcpy(records.data(), v->data(), records.size() * sizeof(T));
  return records;
}

ErrorKind get_kind(uint8_t value, bool& ok) {
  if (value > static_cast<uint8_t>(ErrorKind::kInternal)) ok = false;
  return static_cast<ErrorKind>(value);
}

Message read(const schema::Hello& m, bool&) {
  return Hello{get(m.version()), get(m.token()), get(m.host()), m.pid(),
               m.instance(),     m.threads(),    get(m.isa()),  get(m.engine())};
}
Message read(const schema::Welcome& m, bool& ok) {
  ok = m.heartbeat_ms() > 0;
  return Welcome{m.worker(), m.heartbeat_ms(), m.lease_ms()};
}
Message read(const schema::Job& m, bool& ok) {
  return Job{get_records<std::byte>(m.spec(), ok)};
}
Message read(const schema::JobClass& m, bool&) {
  return JobClass{m.job(), get(m.numeric_class())};
}
Message read(const schema::JobFailed& m, bool& ok) {
  return JobFailed{m.job(), get_kind(m.kind(), ok), get(m.reason())};
}
// By copy: the verifier checks the alignment of a vector's count, not of its elements.
std::vector<uint64_t> get(const fb::Vector<uint64_t>* v) {
  std::vector<uint64_t> values(v ? v->size() : 0);
  if (!values.empty()) std::memcpy(values.data(), v->Data(), values.size() * sizeof(uint64_t));
  return values;
}

Message read(const schema::Credits& m, bool&) {
  return Credits{m.job(), m.units(), get(m.held())};
}
Message read(const schema::ChunkRequest& m, bool& ok) {
  ChunkRequest request{get_records<Digest>(m.ids(), ok), m.compress()};
  if (request.ids.size() > kMaxIdsPerRequest) ok = false;
  return request;
}
Message read(const schema::UnitFailed& m, bool& ok) {
  return UnitFailed{m.job(), m.unit(), m.lease(), get_kind(m.kind(), ok), get(m.reason())};
}
Message read(const schema::CommitAck& m, bool& ok) {
  const auto digests = get_records<Digest>(m.digest(), ok);
  ok = ok && digests.size() == 1;
  return CommitAck{m.job(), m.unit(), ok ? digests[0] : Digest{}};
}
Message read(const schema::Heartbeat& m, bool&) {
  return Heartbeat{m.running(), m.queued(), m.oldest_ms()};
}
Message read(const schema::Drain& m, bool&) {
  return Drain{get(m.units()), get(m.reason())};
}
Message read(const schema::Goodbye& m, bool&) {
  return Goodbye{get(m.reason())};
}
Message read(const schema::Withdraw& m, bool&) {
  return Withdraw{m.job(), get(m.units())};
}
Message read(const schema::JobEnded& m, bool&) {
  return JobEnded{m.job(), get(m.reason())};
}
Message read(const schema::Pace& m, bool& ok) {
  ok = m.heartbeat_ms() > 0;
  return Pace{m.heartbeat_ms()};
}
Message read(const schema::ClientHello& m, bool&) {
  return ClientHello{get(m.version()), get(m.token()), get(m.user()), get(m.host())};
}
Message read(const schema::ClientWelcome& m, bool&) {
  return ClientWelcome{get(m.version()), get(m.role())};
}

template <class Table>
Expected<Message> read_table(Payload payload) {
  const auto* data = reinterpret_cast<const uint8_t*>(payload.data());
  fb::Verifier verifier(data, payload.size());
  if (!verifier.VerifyBuffer<Table>(nullptr))
    return fail(ErrorKind::kProtocol, "a message is not well formed");
  bool ok = true;
  Message message = read(*fb::GetRoot<Table>(data), ok);
  if (!ok) return fail(ErrorKind::kProtocol, "a message holds a value out of range");
  return message;
}

MessageType type_of(const Message& message) {
  using T = MessageType;
  constexpr T types[] = {T::kHello,     T::kWelcome,     T::kRefused,       T::kJob,        T::kJobClass,
                         T::kJobFailed, T::kCredits,     T::kChunkRequest,  T::kUnitFailed, T::kCommitAck,
                         T::kHeartbeat, T::kDrain,       T::kGoodbye,       T::kWithdraw,   T::kJobEnded,
                         T::kPace,      T::kClientHello, T::kClientWelcome, T::kChunkPiece, T::kUnit,
                         T::kResult,    T::kRequest,     T::kReply};
  static_assert(std::size(types) == std::variant_size_v<Message>);
  return types[message.index()];
}

}  // namespace

Bytes encode(const Message& message) {
  Bytes frame = std::visit([](const auto& m) { return write(m); }, message);
  seal_frame(type_of(message), frame);
  return frame;
}

Expected<Message> decode(const FrameHeader& header, Payload payload) {
  if (header.type == MessageType::kRefused)
    return Message(Refused{
        std::string(reinterpret_cast<const char*>(payload.data()), std::min(payload.size(), kMaxTextBytes))});
  if (header.major != kWireMajor)
    return fail(ErrorKind::kProtocol,
                text("the peer speaks protocol {}.{} and this program {}.{}: install the "
                     "same release on both machines",
                     header.major, header.minor, kWireMajor, kWireMinor));
  switch (header.type) {
    case MessageType::kHello:
      return read_table<schema::Hello>(payload);
    case MessageType::kWelcome:
      return read_table<schema::Welcome>(payload);
    case MessageType::kRefused:
      break;
    case MessageType::kJob:
      return read_table<schema::Job>(payload);
    case MessageType::kJobClass:
      return read_table<schema::JobClass>(payload);
    case MessageType::kJobFailed:
      return read_table<schema::JobFailed>(payload);
    case MessageType::kCredits:
      return read_table<schema::Credits>(payload);
    case MessageType::kChunkRequest:
      return read_table<schema::ChunkRequest>(payload);
    case MessageType::kUnitFailed:
      return read_table<schema::UnitFailed>(payload);
    case MessageType::kCommitAck:
      return read_table<schema::CommitAck>(payload);
    case MessageType::kHeartbeat:
      return read_table<schema::Heartbeat>(payload);
    case MessageType::kDrain:
      return read_table<schema::Drain>(payload);
    case MessageType::kGoodbye:
      return read_table<schema::Goodbye>(payload);
    case MessageType::kWithdraw:
      return read_table<schema::Withdraw>(payload);
    case MessageType::kJobEnded:
      return read_table<schema::JobEnded>(payload);
    case MessageType::kPace:
      return read_table<schema::Pace>(payload);
    case MessageType::kClientHello:
      return read_table<schema::ClientHello>(payload);
    case MessageType::kClientWelcome:
      return read_table<schema::ClientWelcome>(payload);
    case MessageType::kChunkPiece:
      return blocks::read_chunk_piece(payload);
    case MessageType::kUnit:
      return blocks::read_unit(payload);
    case MessageType::kResult:
      return blocks::read_result(payload);
    case MessageType::kRequest:
      return blocks::read_request(payload);
    case MessageType::kReply:
      return blocks::read_reply(payload);
  }
  return fail(ErrorKind::kProtocol, "unknown message type");
}

}  // namespace kiln
