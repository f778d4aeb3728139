// One client's connection. Lives on the farm's thread; requests and pieces are processed in order
// by one pool thread at a time, which also reads the files that are sent here.
#pragma once

#include <deque>
#include <memory>
#include <mutex>
#include <variant>

#include "coordinator/farm/dispatch/client_talk.h"
#include "coordinator/service/client_files.h"
#include "coordinator/service/people.h"

namespace kiln {

class ServiceImpl;

class ClientSession final : public ClientTalk {
 public:
  ClientSession(ServiceImpl& service, const Caller& caller, ClientLink& link);
  ~ClientSession() override;
  std::string role() const override;
  uint32_t max_message_bytes() const override;
  void on_request(Request request) override;
  void on_piece(ChunkPiece piece) override;
  Status on_chunk_request(ChunkRequest request) override;
  void on_room() override;

 private:
  struct Shared;
  void give(std::variant<Request, ChunkPiece> work, size_t bytes);
  std::shared_ptr<Shared> shared_;
};

}  // namespace kiln
