// Records what a worker says and hears.
#pragma once

#include <cstdio>

#include "worker/agent/recording.h"
#include "worker/agent/socket_environment.h"

namespace kiln {

// Writes records as they happen. At kMaxRecordingBytes, or when the disk fails, it warns and stops.
class Recorder {
 public:
  // Fails (kUsage) if the file exists, so that no recording is lost.
  static Expected<std::shared_ptr<Recorder>> open(const std::string& file, Timing& timing,
                                                  uint64_t max_bytes = kMaxRecordingBytes);
  ~Recorder();
  void note(Recorded kind, Bytes content);

 private:
  Recorder(std::string name, std::FILE* file, Timing& timing, uint64_t max_bytes)
      : name_(std::move(name)), file_(file), timing_(timing), left_(max_bytes), begun_(timing.now_ms()) {}
  bool write(const Bytes& bytes);
  void stop(const std::string& reason);

  const std::string name_;
  std::FILE* file_;  // null: stopped
  Timing& timing_;
  uint64_t left_;
  const int64_t begun_;
};

// The same link, recorded.
std::unique_ptr<Link> recorded(std::unique_ptr<Link> link, std::shared_ptr<Recorder> recorder);

// The socket environment, recorded. Chunks are asked for again although they are on disk, so that a recording
// has all that it takes to play it.
class RecordingEnvironment final : public SocketEnvironment {
 public:
  RecordingEnvironment(const AgentSettings& settings) : SocketEnvironment(settings) {}
  Status open(const std::string& file);
  void connect(std::function<void(Expected<std::unique_ptr<Link>>)> done) override;
  void look_up(std::vector<Digest> ids, std::function<void(std::vector<ChunkBytes>)> done) override;

 private:
  std::shared_ptr<Recorder> recorder_;
};

}  // namespace kiln
