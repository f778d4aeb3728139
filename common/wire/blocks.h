// Data messages as raw little-endian blocks behind a fixed head: their bytes can be hashed and compared.
// Internal to common/wire.
#pragma once

#include "common/wire/messages.h"

namespace kiln::blocks {

// Whole frames, not yet sealed: the first kFrameHeaderBytes are zero.
Bytes write(const ChunkPiece& piece);
Bytes write(const Unit& unit);
Bytes write(const Result& result);
Bytes write(const Request& request);
Bytes write(const Reply& reply);

Expected<Message> read_chunk_piece(std::span<const std::byte> payload);
Expected<Message> read_unit(std::span<const std::byte> payload);
Expected<Message> read_result(std::span<const std::byte> payload);
Expected<Message> read_request(std::span<const std::byte> payload);
Expected<Message> read_reply(std::span<const std::byte> payload);

}  // namespace kiln::blocks
