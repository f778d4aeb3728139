// ROOM: add a message: a struct here, with its number, name and fields (common/base/fields.h), and its name
// in Message. Encoding, limits, checks, seeds for the fuzzer and samples for tests follow; the end that
// receives it has a handler (Agent::handle, Session::handle), any other peer is told that it is out of place.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "common/job/unit.h"
#include "common/wire/frame.h"
#include "common/wire/limits.h"
#include "common/wire/special_fields.h"

namespace kiln {

// What stands in the frame, and the name for people. Numbers are on the wire: append, never renumber. Below
// 256 are control messages, from there data, which may be larger.
struct MessageKind {
  MessageType type;
  std::string_view name;
  constexpr MessageKind(uint16_t number, std::string_view n) : type{number}, name(n) {}
};

// w: worker to coordinator, c: coordinator to worker.
struct Hello {  // w, first
  std::string version, token, host;
  uint32_t pid = 0;
  uint64_t instance = 0;
  uint32_t threads = 1;
  std::string isa, engine;
  static constexpr MessageKind kKind{1, "Hello"};
  static void fields(auto& m, auto& v) {
    v(m.version, m.token, m.host, m.pid, m.instance, m.threads, m.isa, m.engine);
  }
};
struct Welcome {  // c
  uint32_t worker = 0, heartbeat_ms = 0, lease_ms = 0;
  static constexpr MessageKind kKind{2, "Welcome"};
  static void fields(auto& m, auto& v) { v(m.worker, m.heartbeat_ms, m.lease_ms); }
  const char* fault() const { return heartbeat_ms ? nullptr : "its interval of heartbeats is zero"; }
};
struct Refused {  // c or w, last: the reason and the way out
  std::string reason;
  static constexpr MessageKind kKind{3, "Refused"};
  static void fields(auto& m, auto& v) { v(RestOfText{m.reason}); }
};
struct Job {  // c
  JobSpec spec;
  static constexpr MessageKind kKind{4, "Job"};
  static void fields(auto& m, auto& v) { v(m.spec); }
};
struct JobClass {  // w: numeric class for the job's kernels
  uint64_t job = 0;
  std::string numeric_class;
  static constexpr MessageKind kKind{5, "JobClass"};
  static void fields(auto& m, auto& v) { v(m.job, m.numeric_class); }
};
struct JobFailed {  // w: the scene could not be prepared
  uint64_t job = 0;
  ErrorKind kind = ErrorKind::kInternal;
  std::string reason;
  static constexpr MessageKind kKind{6, "JobFailed"};
  static void fields(auto& m, auto& v) { v(m.job, m.kind, m.reason); }
};
struct Credits {  // w: the scene is ready, and at most `units` may be with this worker at a time
  uint64_t job = 0;
  uint32_t units = 0;
  std::vector<uint64_t> held{};  // units of this job that the worker already holds, so that a restarted
                                 // coordinator need not give them to others
  static constexpr MessageKind kKind{7, "Credits"};
  static void fields(auto& m, auto& v) { v(m.job, m.units, m.held); }
};
struct ChunkRequest {  // w, client
  std::vector<Digest> ids;
  bool compress = false;
  static constexpr MessageKind kKind{8, "ChunkRequest"};
  static void fields(auto& m, auto& v) { v(at_most(m.ids, kMaxIdsPerRequest), m.compress); }
};
struct ChunkPiece {  // c, or a client that uploads; data; pieces of a chunk come in order
  Digest id;
  uint64_t offset = 0, total = 0;
  Bytes bytes;
  bool compress = false;  // on the wire; `bytes` never are
  static constexpr MessageKind kKind{256, "ChunkPiece"};
  static void fields(auto& m, auto& v) { v(m.id, m.offset, m.total, PackedBytes{m.bytes, m.compress}); }
  const char* fault() const {
    const bool fits = total <= kMaxChunkBytes && offset <= total && bytes.size() <= total - offset;
    return fits ? nullptr : "it lies outside its chunk";
  }
};
struct Unit {  // c, data
  uint64_t job = 0, lease = 0;
  WorkUnit unit;
  static constexpr MessageKind kKind{257, "Unit"};
  static void fields(auto& m, auto& v) { v(m.job, m.lease, m.unit); }
};
struct Result {  // w, data; kept by the worker until its CommitAck
  uint64_t job = 0, lease = 0;
  UnitResult result;
  Digest digest;       // result_digest() by the worker
  uint64_t shape = 0;  // unit_shape() of the baked unit; 0: not given
  static constexpr MessageKind kKind{258, "Result"};
  static void fields(auto& m, auto& v) { v(m.job, m.lease, m.result, m.digest, m.shape); }
};
struct UnitFailed {  // w
  uint64_t job = 0, unit = 0, lease = 0;
  ErrorKind kind = ErrorKind::kInternal;
  std::string reason;
  static constexpr MessageKind kKind{9, "UnitFailed"};
  static void fields(auto& m, auto& v) { v(m.job, m.unit, m.lease, m.kind, m.reason); }
};
struct CommitAck {  // c: the result is committed, or was already: forget it
  uint64_t job = 0, unit = 0;
  Digest digest;
  static constexpr MessageKind kKind{10, "CommitAck"};
  static void fields(auto& m, auto& v) { v(m.job, m.unit, m.digest); }
};
struct Heartbeat {  // w
  uint32_t running = 0, queued = 0;
  uint64_t oldest_ms = 0;  // since the oldest running unit was begun
  static constexpr MessageKind kKind{11, "Heartbeat"};
  static void fields(auto& m, auto& v) { v(m.running, m.queued, m.oldest_ms); }
};
struct Drain {  // w: send no more units; these were not started
  std::vector<uint64_t> units;
  std::string reason;
  static constexpr MessageKind kKind{12, "Drain"};
  static void fields(auto& m, auto& v) { v(m.units, m.reason); }
};
struct Goodbye {  // c or w, last
  std::string reason;
  static constexpr MessageKind kKind{13, "Goodbye"};
  static void fields(auto& m, auto& v) { v(m.reason); }
};

struct Withdraw {  // c: these units are no longer needed: do not start them, drop their results
  uint64_t job = 0;
  std::vector<uint64_t> units;
  static constexpr MessageKind kKind{14, "Withdraw"};
  static void fields(auto& m, auto& v) { v(m.job, m.units); }
};
struct JobEnded {  // c: forget the job, its units and their stored results; another may follow
  uint64_t job = 0;
  std::string reason;
  static constexpr MessageKind kKind{15, "JobEnded"};
  static void fields(auto& m, auto& v) { v(m.job, m.reason); }
};
struct Pace {  // c: interval of heartbeats from now on
  uint32_t heartbeat_ms = 0;
  static constexpr MessageKind kKind{16, "Pace"};
  static void fields(auto& m, auto& v) { v(m.heartbeat_ms); }
  const char* fault() const { return heartbeat_ms ? nullptr : "its interval of heartbeats is zero"; }
};
struct ClientHello {  // a person's program, first instead of Hello
  std::string version, token, user, host;
  static constexpr MessageKind kKind{17, "ClientHello"};
  static void fields(auto& m, auto& v) { v(m.version, m.token, m.user, m.host); }
};
struct ClientWelcome {  // c, to a client: its permissions ("read", "submit", "admin")
  std::string version, role;
  static constexpr MessageKind kKind{18, "ClientWelcome"};
  static void fields(auto& m, auto& v) { v(m.version, m.role); }
};
struct Request {  // client, data: answered by the Reply of the same id, in order
  uint64_t id = 0;
  std::string verb;      // "submit", "jobs", ...: coordinator/service
  std::string document;  // JSON
  static constexpr MessageKind kKind{259, "Request"};
  static void fields(auto& m, auto& v) { v(m.id, m.verb, at_most(m.document, kMaxDocumentBytes)); }
};
struct Reply {  // c, data
  uint64_t id = 0;
  bool ok = true;
  ErrorKind kind = ErrorKind::kInternal;  // if not ok
  std::string document;                   // JSON; if not ok: the sentence of the error
  static constexpr MessageKind kKind{260, "Reply"};
  static void fields(auto& m, auto& v) { v(m.id, m.ok, m.kind, at_most(m.document, kMaxDocumentBytes)); }
};

using Message = std::variant<Hello, Welcome, Refused, Job, JobClass, JobFailed, Credits, ChunkRequest,
                             UnitFailed, CommitAck, Heartbeat, Drain, Goodbye, Withdraw, JobEnded, Pace,
                             ClientHello, ClientWelcome, ChunkPiece, Unit, Result, Request, Reply>;

// A whole frame. Texts above kMaxTextBytes are cut; a data message must fit kMaxDataBytes.
Bytes encode(const Message& message);

// Parses a payload whose checksum matched. Fails (kProtocol) on another version (except Refused) and on
// anything malformed; never reads outside `payload`.
Expected<Message> decode(const FrameHeader& header, std::span<const std::byte> payload);

// "Hello", for people. Empty: no such type.
std::string_view message_name(MessageType type);

// Handlers of std::visit, one per message.
template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

}  // namespace kiln
