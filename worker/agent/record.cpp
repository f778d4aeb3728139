#include "worker/agent/record.h"

#include <fcntl.h>

#include <algorithm>
#include <cerrno>
#include <cstring>

#include "common/base/check.h"
#include "common/base/format.h"
#include "common/base/log.h"

namespace kiln {
namespace {

Bytes without_secrets(const Message& message) {
  const auto* hello = std::get_if<Hello>(&message);
  if (!hello) return encode(message);
  Hello open = *hello;
  open.token.clear();
  return encode(open);
}

class RecordedLink final : public Link {
 public:
  RecordedLink(std::unique_ptr<Link> link, std::shared_ptr<Recorder> recorder)
      : link_(std::move(link)), recorder_(std::move(recorder)) {
    KILN_CHECK(link_ && recorder_);
  }
  void start(Connection::Handlers handlers, size_t budget) override {
    recorder_->note(Recorded::kOpened, {});
    Connection::Handlers outer = handlers;
    outer.on_frame = [recorder = recorder_, inner = handlers.on_frame](const FrameHeader& header,
                                                                       std::span<const std::byte> payload) {
      Bytes frame(kFrameHeaderBytes + payload.size());
      std::copy(payload.begin(), payload.end(), frame.begin() + kFrameHeaderBytes);
      seal_frame(header.type, frame);
      // Another version is refused by the agent before anything is made of it.
      if (header.version == kWireVersion) recorder->note(Recorded::kReceived, std::move(frame));
      inner(header, payload);
    };
    outer.on_closed = [recorder = recorder_, inner = handlers.on_closed](const std::string& reason) {
      const auto words = bytes_of(std::string_view(reason));
      recorder->note(Recorded::kClosed, Bytes(words.begin(), words.end()));
      inner(reason);
    };
    link_->start(std::move(outer), budget);
  }
  void accept_data(uint32_t max_bytes) override { link_->accept_data(max_bytes); }
  void send(const Message& message) override {
    recorder_->note(Recorded::kSent, without_secrets(message));
    link_->send(message);
  }
  size_t queued_bytes() const override { return link_->queued_bytes(); }
  void drop_queued() override { link_->drop_queued(); }
  void close_after_writes(std::string reason) override { link_->close_after_writes(std::move(reason)); }
  std::string peer() const override { return link_->peer(); }
  std::string caller() const override { return link_->caller(); }
  bool loopback() const override { return link_->loopback(); }
  const PeerIdentity& peer_identity() const override { return link_->peer_identity(); }

 private:
  const std::unique_ptr<Link> link_;
  const std::shared_ptr<Recorder> recorder_;
};

}  // namespace

Expected<std::shared_ptr<Recorder>> Recorder::open(const std::string& file, Timing& timing,
                                                   uint64_t max_bytes) {
  // Scenes and results are in it: it is its owner's alone.
  const int descriptor = ::open(file.c_str(), O_CREAT | O_EXCL | O_WRONLY | O_CLOEXEC, 0600);
  std::FILE* opened = descriptor < 0 ? nullptr : ::fdopen(descriptor, "wb");
  if (!opened)
    return fail(ErrorKind::kUsage,
                text("cannot record to {}: {}. --record names a file that does not exist yet", file,
                     std::strerror(errno)));
  std::shared_ptr<Recorder> recorder(new Recorder(file, opened, timing, max_bytes));
  recorder->write(write_recording_head());
  return recorder;
}

Recorder::~Recorder() {
  if (file_) std::fclose(file_);
}

bool Recorder::write(const Bytes& bytes) {
  if (bytes.size() > left_) {
    stop("it is as large as recordings may be");
    return false;
  }
  left_ -= bytes.size();
  // Flushed at once: a crash is what a recording is for.
  if (std::fwrite(bytes.data(), 1, bytes.size(), file_) == bytes.size() && std::fflush(file_) == 0)
    return true;
  stop(std::strerror(errno));
  return false;
}

void Recorder::note(Recorded kind, Bytes content) {
  if (!file_) return;
  write(write_record({kind, static_cast<uint64_t>(timing_.now_ms() - begun_), std::move(content)}));
}

void Recorder::stop(const std::string& reason) {
  log_warning(text("the recording in {} ends here: {}", name_, reason));
  std::fclose(file_);
  file_ = nullptr;
}

std::unique_ptr<Link> recorded(std::unique_ptr<Link> link, std::shared_ptr<Recorder> recorder) {
  return std::make_unique<RecordedLink>(std::move(link), std::move(recorder));
}

Status RecordingEnvironment::open(const std::string& file) {
  KILN_TRY(recorder_, Recorder::open(file, timing()));
  return {};
}

void RecordingEnvironment::connect(std::function<void(Expected<std::unique_ptr<Link>>)> done) {
  SocketEnvironment::connect([this, done](Expected<std::unique_ptr<Link>> link) {
    if (link) return done(recorded(std::move(*link), recorder_));
    done(std::move(link));
  });
}

void RecordingEnvironment::look_up(std::vector<Digest> ids,
                                   std::function<void(std::vector<ChunkBytes>)> done) {
  timing().post([done, count = ids.size()] { done(std::vector<ChunkBytes>(count)); });
}

}  // namespace kiln
