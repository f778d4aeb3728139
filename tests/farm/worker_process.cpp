#include "tests/farm/worker_process.h"

#include <chrono>
#include <thread>

#include "common/base/clock.h"
#include "common/wire/limits.h"
#include "tests/support/paths.h"

namespace kiln::test {

WorkerProcess::WorkerProcess(uint16_t port, const std::vector<std::string>& arguments) {
  std::vector<std::string> command{(binary_dir() / "bin/kiln-stub-worker").string()};
  command.insert(command.end(), arguments.begin(), arguments.end());
  process = *ChildProcess::spawn(command, {"KILN_CONNECT=127.0.0.1:" + std::to_string(port),
                                           "KILN_TOKEN=token", "KILN_THREADS=1", "KILN_CACHE=off"});
}

void WorkerProcess::listen() {
  for (const std::string& line : process.read_lines()) said += line + "\n";
}

bool WorkerProcess::ended_with(int status) {
  const SteadyClock clock;
  for (const int64_t limit = clock.now_ms() + 10000; process.running() && clock.now_ms() < limit;) {
    listen();
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  listen();
  return process.exited_with(status);
}

bool WorkerProcess::says(const std::string& words) {
  const SteadyClock clock;
  for (const int64_t limit = clock.now_ms() + 5000; clock.now_ms() < limit;) {
    listen();
    if (said.find(words) != std::string::npos) return true;
    std::this_thread::sleep_for(std::chrono::milliseconds(2));
  }
  return false;
}

void serve_chunks(RawPeer& peer, const ChunkStore& chunks, const ChunkRequest& request) {
  for (const Digest& id : request.ids) {
    const Bytes& bytes = *chunks.find(id);
    for (size_t at = 0; at < bytes.size(); at += kChunkPieceBytes) {
      const size_t end = std::min(bytes.size(), at + kChunkPieceBytes);
      peer.send(ChunkPiece{id, at, bytes.size(), Bytes(bytes.begin() + at, bytes.begin() + end), true});
    }
  }
}

bool welcome(RawPeer& peer) {
  if (!peer.next<Hello>()) return false;
  peer.send(Welcome{1, 100, 1000});
  return true;
}

std::optional<Credits> give_job(RawPeer& peer, const TestJob& job, size_t* asked) {
  peer.send(Job{job.spec});
  const SteadyClock clock;
  const int64_t limit = clock.now_ms() + 5000;  // heartbeats come for ever
  while (auto message = clock.now_ms() < limit ? peer.receive() : std::nullopt) {
    if (const auto* request = std::get_if<ChunkRequest>(&*message)) {
      if (asked) *asked += request->ids.size();
      serve_chunks(peer, job.chunks, *request);
    }
    if (const auto* credits = std::get_if<Credits>(&*message); credits && credits->job == job.spec.id)
      return *credits;
  }
  return std::nullopt;
}

std::optional<Credits> make_ready(RawPeer& peer, const TestJob& job, size_t* asked) {
  if (!welcome(peer)) return std::nullopt;
  return give_job(peer, job, asked);
}

Unit unit_of(const TestJob& job, uint64_t id) {
  return {job.spec.id, 100 + id, make_units(id, 1)[0]};
}

}  // namespace kiln::test
