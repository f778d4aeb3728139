// File uploads and downloads.
#include <fstream>

#include "common/base/files.h"
#include "common/base/format.h"
#include "common/wire/limits.h"
#include "coordinator/farm/client/client_impl.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

constexpr uint64_t kPiece = 1u << 20;    // of an upload
constexpr uint64_t kWindow = 16u << 20;  // sent before asking the coordinator how much it has
constexpr auto kPatience = std::chrono::minutes(2);

Expected<Digest> digest_of(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  Sha256 hash;
  std::vector<char> buffer(size_t{1} << 20);
  while (in) {
    in.read(buffer.data(), static_cast<std::streamsize>(buffer.size()));
    hash.add(std::as_bytes(std::span(buffer.data(), static_cast<size_t>(in.gcount()))));
  }
  if (!in.eof()) return fail(ErrorKind::kIo, text("cannot read {}", file.string()));
  return hash.finish();
}

std::string upload_document(const Digest& digest, uint64_t size) {
  return JsonWriter().begin_object().pair("digest", digest.hex()).pair("size", size).end_object().take();
}

}  // namespace

Status ServiceClientImpl::send_file(const fs::path& file, const Digest& digest, uint64_t size,
                                    const Progress& progress) {
  std::ifstream in(file, std::ios::binary);
  if (!in) return fail(ErrorKind::kIo, text("cannot read {}", file.string()));
  for (;;) {
    KILN_TRY(const std::string reply, ask("upload", upload_document(digest, size)));
    KILN_TRY(const JsonValue document, parse_json(reply));
    const JsonValue* offset = document.find("offset");
    if (!offset || !offset->is_whole || offset->whole > size)
      return fail(ErrorKind::kProtocol, "the coordinator's answer to an upload is not well formed");
    uint64_t at = offset->whole;
    if (progress) progress(at, size);
    if (at == size) break;
    in.clear();
    in.seekg(static_cast<std::streamoff>(at));
    for (const uint64_t end = std::min(size, at + kWindow); at < end;) {
      ChunkPiece piece{digest, at, size, Bytes(std::min(kPiece, end - at))};
      in.read(reinterpret_cast<char*>(piece.bytes.data()), static_cast<std::streamsize>(piece.bytes.size()));
      if (!in)
        return fail(ErrorKind::kInvalidInput, text("{} became shorter while it was sent", file.string()));
      at += piece.bytes.size();
      link_->send(piece);
      if (const Status s = link_->wait_for_room(kChunkWriteBudget, kPatience); !s) {
        link_.reset();
        return s;
      }
    }
  }
  return ask("uploaded", JsonWriter().begin_object().pair("digest", digest.hex()).end_object().take())
      .map([](const std::string&) {});
}

Status ServiceClientImpl::upload(const fs::path& file, const Digest& digest, uint64_t size,
                                 const Progress& progress) {
  return again<Status>([&] { return send_file(file, digest, size, progress); });
}

Status ServiceClientImpl::receive_file(const Wanted& wanted, const fs::path& part, const Progress& progress) {
  std::error_code code;
  uint64_t have = fs::file_size(part, code);
  if (code || have > wanted.size) {
    fs::remove(part, code);
    have = 0;
  }
  std::ofstream out(part, std::ios::binary | std::ios::app);
  if (!out) return fail(ErrorKind::kIo, text("cannot write {}", part.string()));
  if (progress) progress(have, wanted.size);
  if (have == wanted.size) return {};
  KILN_TRY_STATUS(ask("fetch", JsonWriter()
                                   .begin_object()
                                   .pair("id", wanted.job)
                                   .pair("path", wanted.path)
                                   .pair("from", have)
                                   .end_object()
                                   .take())
                      .map([](const std::string&) {}));
  link_->send(ChunkRequest{{wanted.digest}, false});
  while (have < wanted.size) {
    auto message = link_->next(kPatience);
    if (!message) {
      link_.reset();
      return tl::unexpected<Error>(message.error());
    }
    if (const auto* reply = std::get_if<Reply>(&*message); reply && reply->id == 0)
      return fail(reply->kind, reply->document);
    const auto* piece = std::get_if<ChunkPiece>(&*message);
    if (!piece || piece->id != wanted.digest) continue;
    if (piece->offset != have || piece->bytes.empty() || piece->bytes.size() > wanted.size - have)
      return fail(ErrorKind::kProtocol,
                  text("the coordinator sent other bytes of {} than were asked for", wanted.path));
    out.write(reinterpret_cast<const char*>(piece->bytes.data()),
              static_cast<std::streamsize>(piece->bytes.size()));
    if (!out.flush())
      return fail(ErrorKind::kNoSpace, text("cannot write {}: is the disk full?", part.string()));
    have += piece->bytes.size();
    ++moved_;
    if (progress) progress(have, wanted.size);
  }
  return {};
}

Status ServiceClientImpl::download(const Wanted& wanted, const fs::path& file, const Progress& progress) {
  // Named by its content, so that a part of another version is never resumed.
  const fs::path part =
      file.parent_path() / text(".{}.{}.part", file.filename().string(), wanted.digest.hex().substr(0, 16));
  std::error_code code;
  if (fs::file_size(file, code) == wanted.size && !code)
    if (const auto there = digest_of(file); there && *there == wanted.digest) return {};
  KILN_TRY_STATUS(again<Status>([&] { return receive_file(wanted, part, progress); }));
  KILN_TRY(const Digest digest, digest_of(part));
  if (digest != wanted.digest) {
    fs::remove(part, code);
    // The coordinator read its copy before it sent it.
    return fail(ErrorKind::kIo,
                text("{} was damaged on its way, or what an earlier try left of it in {} was (it "
                     "is removed): fetch it again",
                     wanted.path, file.parent_path().string()));
  }
  fs::rename(part, file, code);
  if (code) return fail(ErrorKind::kIo, text("cannot name {}: {}", file.string(), code.message()));
  return {};
}

}  // namespace kiln
