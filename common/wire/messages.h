// ROOM: add a message: a type in frame.h, a table in messages.fbs, a struct here, a pair of functions in
// messages.cpp (control) or blocks.cpp (data). Both ends then fail to compile until they handle it.
#pragma once

#include <string>
#include <variant>
#include <vector>

#include "common/job/unit.h"
#include "common/wire/frame.h"

namespace kiln {

// w: worker to coordinator, c: coordinator to worker.
struct Hello {  // w, first
  std::string version, token, host;
  uint32_t pid = 0;
  uint64_t instance = 0;
  uint32_t threads = 1;
  std::string isa, engine;
};
struct Welcome {  // c
  uint32_t worker = 0, heartbeat_ms = 0, lease_ms = 0;
};
struct Refused {  // c or w, last: the reason and the way out
  std::string reason;
};
struct Job {   // c
  Bytes spec;  // write_job()
};
struct JobClass {  // w: numeric class for the job's kernels
  uint64_t job = 0;
  std::string numeric_class;
};
struct JobFailed {  // w: the scene could not be prepared
  uint64_t job = 0;
  ErrorKind kind = ErrorKind::kInternal;
  std::string reason;
};
struct Credits {  // w: the scene is ready, and at most `units` may be with this worker at a time
  uint64_t job = 0;
  uint32_t units = 0;
  std::vector<uint64_t> held{};  // units of this job that the worker already holds (minor 1), so that a
                                 // restarted coordinator need not give them to others
};
struct ChunkRequest {  // w, client
  std::vector<Digest> ids;
  bool compress = false;
};
struct ChunkPiece {  // c, or a client that uploads; data; pieces of a chunk come in order
  Digest id;
  uint64_t offset = 0, total = 0;
  Bytes bytes;
  bool compress = false;  // on the wire; `bytes` never are
};
struct Unit {  // c, data
  uint64_t job = 0, lease = 0;
  WorkUnit unit;  // with replicate and cache in minor 2
};
struct Result {  // w, data; kept by the worker until its CommitAck
  uint64_t job = 0, lease = 0;
  UnitResult result;
  Digest digest;       // result_digest() by the worker
  uint64_t shape = 0;  // unit_shape() of the baked unit (minor 2); 0: not given
};
struct UnitFailed {  // w
  uint64_t job = 0, unit = 0, lease = 0;
  ErrorKind kind = ErrorKind::kInternal;
  std::string reason;
};
struct CommitAck {  // c: the result is committed, or was already: forget it
  uint64_t job = 0, unit = 0;
  Digest digest;
};
struct Heartbeat {  // w
  uint32_t running = 0, queued = 0;
  uint64_t oldest_ms = 0;  // since the oldest running unit was begun (minor 1)
};
struct Drain {  // w: send no more units; these were not started
  std::vector<uint64_t> units;
  std::string reason;
};
struct Goodbye {  // c or w, last
  std::string reason;
};

// Minor 1: not sent to a peer whose frames say minor 0.
struct Withdraw {  // c: these units are no longer needed: do not start them, drop their results
  uint64_t job = 0;
  std::vector<uint64_t> units;
};
struct JobEnded {  // c: forget the job, its units and their stored results; another may follow
  uint64_t job = 0;
  std::string reason;
};
struct Pace {  // c: interval of heartbeats from now on
  uint32_t heartbeat_ms = 0;
};
struct ClientHello {  // a person's program, first instead of Hello
  std::string version, token, user, host;
};
struct ClientWelcome {  // c, to a client: its permissions ("read", "submit", "admin")
  std::string version, role;
};
struct Request {  // client, data: answered by the Reply of the same id, in order
  uint64_t id = 0;
  std::string verb;      // "submit", "jobs", ...: coordinator/service
  std::string document;  // JSON
};
struct Reply {  // c, data
  uint64_t id = 0;
  bool ok = true;
  ErrorKind kind = ErrorKind::kInternal;  // if not ok
  std::string document;                   // JSON; if not ok: the sentence of the error
};

using Message = std::variant<Hello, Welcome, Refused, Job, JobClass, JobFailed, Credits, ChunkRequest,
                             UnitFailed, CommitAck, Heartbeat, Drain, Goodbye, Withdraw, JobEnded, Pace,
                             ClientHello, ClientWelcome, ChunkPiece, Unit, Result, Request, Reply>;

// A whole frame. Texts above kMaxTextBytes are cut; a data message must fit kMaxDataBytes.
Bytes encode(const Message& message);

// Parses a payload whose checksum matched. Fails (kProtocol) on another major (except Refused) and on
// anything malformed; never reads outside `payload`.
Expected<Message> decode(const FrameHeader& header, std::span<const std::byte> payload);

// Whether a peer with an earlier minor cannot read this message: it must not be sent to one.
inline bool needs_minor_2(const Unit& unit) {
  return unit.unit.replicate != 0 || unit.unit.cache != Digest{};
}

// Handlers of std::visit, one per message.
template <class... F>
struct Overloaded : F... {
  using F::operator()...;
};
template <class... F>
Overloaded(F...) -> Overloaded<F...>;

}  // namespace kiln
