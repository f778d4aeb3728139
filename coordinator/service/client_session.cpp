#include "coordinator/service/client_session.h"

#include <fcntl.h>
#include <unistd.h>

#include <atomic>

#include "common/base/format.h"
#include "common/base/log.h"
#include "common/wire/limits.h"
#include "coordinator/service/service_impl.h"
#include "coordinator/service/verbs.h"

namespace kiln {
namespace {

constexpr size_t kMaxRequests = 32;
constexpr size_t kMaxWaitingBytes = 32u << 20;  // requests and pieces waiting for a thread
constexpr size_t kMaxFiles = 4096;              // waiting to be sent
constexpr size_t kReadBytes = 1u << 20;

struct Download {
  Digest digest;
  uint64_t offset = 0;
};

Expected<ChunkPiece> read_piece(const BlobStore& blobs, const Download& download) {
  KILN_TRY(const uint64_t total, blobs.size(download.digest));
  ChunkPiece piece;
  piece.id = download.digest;
  piece.offset = download.offset;
  piece.total = total;
  if (download.offset > total) return fail(ErrorKind::kInvalidInput, "a file is shorter than it was");
  piece.bytes.resize(std::min<uint64_t>(kReadBytes, total - download.offset));
  const int file = ::open(blobs.path(download.digest).c_str(), O_RDONLY | O_CLOEXEC);
  size_t done = 0;
  while (file >= 0 && done < piece.bytes.size()) {
    const ssize_t got = ::pread(file, piece.bytes.data() + done, piece.bytes.size() - done,
                                static_cast<off_t>(download.offset + done));
    if (got < 0 && errno == EINTR) continue;
    if (got <= 0) break;
    done += static_cast<size_t>(got);
  }
  if (file >= 0) ::close(file);
  if (done < piece.bytes.size())
    return fail(ErrorKind::kIo, text("the file {} cannot be read", download.digest.hex()));
  return piece;
}

}  // namespace

// Outlives the session while pool threads work for it.
struct ClientSession::Shared : std::enable_shared_from_this<Shared> {
  Shared(ServiceImpl& s, const Caller& c, ClientLink& l)
      : service(s), caller(c), link(&l), files(s.blobs()) {}
  ServiceImpl& service;
  const Caller caller;
  ClientLink* link;  // farm's thread only; null: connection closed
  ClientFiles files;

  std::mutex mutex;
  std::deque<std::pair<std::variant<Request, ChunkPiece>, size_t>> work;
  size_t requests = 0, bytes = 0;
  bool working = false;

  std::deque<Download> downloads;  // farm's thread only
  bool reading = false;

  void work_off();
  void answer_request(const Request& request);
  void read_next();
};

ClientSession::ClientSession(ServiceImpl& service, const Caller& caller, ClientLink& link)
    : shared_(std::make_shared<Shared>(service, caller, link)) {}

ClientSession::~ClientSession() {
  shared_->link = nullptr;
  const std::lock_guard lock(shared_->mutex);
  shared_->work.clear();
}

std::string ClientSession::role() const {
  return access_name(shared_->caller.access);
}

uint32_t ClientSession::max_message_bytes() const {
  return shared_->caller.access < Access::kSubmit ? kMaxReaderBytes : kMaxDataBytes;
}

void ClientSession::give(std::variant<Request, ChunkPiece> work, size_t bytes) {
  const std::lock_guard lock(shared_->mutex);
  shared_->requests += std::holds_alternative<Request>(work);
  shared_->bytes += bytes;
  shared_->work.emplace_back(std::move(work), bytes);
  if (std::exchange(shared_->working, true)) return;
  shared_->service.pool().give([shared = shared_] { shared->work_off(); });
}

void ClientSession::on_request(Request request) {
  const size_t bytes = request.document.size() + request.verb.size();
  bool full = false;
  {
    const std::lock_guard lock(shared_->mutex);
    full = shared_->requests >= kMaxRequests || shared_->bytes + bytes > kMaxWaitingBytes;
  }
  if (full)
    return shared_->link->send(
        Reply{request.id, false, ErrorKind::kUnavailable,
              text("more than {} requests, or {} MiB, wait already: wait for their replies", kMaxRequests,
                   kMaxWaitingBytes >> 20)});
  if (shared_->link->queued_bytes() > kChunkWriteBudget)
    return shared_->link->send(Reply{request.id, false, ErrorKind::kUnavailable,
                                     "earlier replies have not been read: read them first"});
  give(std::move(request), bytes);
}

void ClientSession::on_piece(ChunkPiece piece) {
  if (shared_->caller.access < Access::kSubmit) return;  // an upload cannot have been started
  bool full = false;
  {
    const std::lock_guard lock(shared_->mutex);
    full = shared_->bytes + piece.bytes.size() > kMaxWaitingBytes;
  }
  if (full)
    return shared_->files.refuse_piece(piece.id,
                                       text("pieces come faster than the disk takes them: at most {} MiB "
                                            "may be under way",
                                            kMaxWaitingBytes >> 20));
  const size_t bytes = piece.bytes.size();
  give(std::move(piece), bytes);
}

Status ClientSession::on_chunk_request(ChunkRequest request) {
  for (const Digest& digest : request.ids) {
    const auto from = shared_->files.take_download(digest);
    if (!from) return fail(ErrorKind::kUsage, "request the file by its job and path first");
    if (shared_->downloads.size() >= kMaxFiles)
      return fail(ErrorKind::kUsage, text("more than {} files were asked for at once", kMaxFiles));
    shared_->downloads.push_back({digest, *from});
  }
  shared_->read_next();
  return {};
}

void ClientSession::on_room() {
  shared_->read_next();
}

void ClientSession::Shared::work_off() {
  for (;;) {
    std::variant<Request, ChunkPiece> next;
    size_t size = 0;
    {
      const std::lock_guard lock(mutex);
      if (work.empty()) {
        working = false;
        return;
      }
      next = std::move(work.front().first);
      size = work.front().second;
      work.pop_front();
    }
    if (const auto* request = std::get_if<Request>(&next))
      answer_request(*request);
    else
      files.append(std::get<ChunkPiece>(next));
    const std::lock_guard lock(mutex);
    bytes -= std::min(bytes, size);
    if (std::holds_alternative<Request>(next)) --requests;
  }
}

void ClientSession::Shared::answer_request(const Request& request) {
  auto document = answer(service, caller, request.verb, request.document, files);
  Reply reply{request.id, document.has_value(), ErrorKind::kInternal, ""};
  if (document && document->size() > kMaxDocumentBytes)
    document = fail(
        ErrorKind::kUsage,
        text("the answer has {} bytes, more than fit a message: request fewer at a time", document->size()));
  reply.ok = document.has_value();
  if (!document) reply.kind = document.error().kind;
  reply.document = document ? std::move(*document) : document.error().message;
  service.farm().post([self = shared_from_this(), reply = std::move(reply)] {
    if (self->link) self->link->send(reply);
  });
}

// Pieces are read one at a time, and only while little is queued.
void ClientSession::Shared::read_next() {
  if (reading || downloads.empty() || !link || link->queued_bytes() >= kChunkWriteBudget) return;
  reading = true;
  service.pool().give([self = shared_from_this(), download = downloads.front()] {
    auto piece = read_piece(self->service.blobs(), download);
    self->service.farm().post([self, piece = std::move(piece)]() mutable {
      self->reading = false;
      if (!self->link) return;
      if (!piece) {
        log_warning(piece.error().message);
        self->link->send(Reply{0, false, piece.error().kind, piece.error().message});  // 0: no request
        self->downloads.pop_front();
      } else {
        self->downloads.front().offset += piece->bytes.size();
        const bool last = piece->offset + piece->bytes.size() == piece->total;
        self->link->send(*piece);
        if (last) self->downloads.pop_front();
      }
      self->read_next();
    });
  });
}

}  // namespace kiln
