#include "coordinator/farm/queue/sqlite.h"

#include <fcntl.h>
#include <sqlite3.h>

#include <utility>

#include "common/base/check.h"
#include "common/base/format.h"
#include "coordinator/farm/queue/open_file.h"

namespace kiln {
namespace fs = std::filesystem;

Query::Query(Query&& other) noexcept
    : database_(other.database_),
      statement_(std::exchange(other.statement_, nullptr)),
      code_(other.code_),
      bound_(other.bound_),
      column_(other.column_) {}

Query::~Query() {
  if (!statement_) return;
  sqlite3_reset(statement_);
  sqlite3_clear_bindings(statement_);
}

Query& Query::bind(int64_t value) {
  if (code_ == SQLITE_OK) code_ = sqlite3_bind_int64(statement_, ++bound_, value);
  return *this;
}
Query& Query::bind(double value) {
  if (code_ == SQLITE_OK) code_ = sqlite3_bind_double(statement_, ++bound_, value);
  return *this;
}
Query& Query::bind(std::string_view value) {
  if (code_ == SQLITE_OK)
    code_ = sqlite3_bind_text64(statement_, ++bound_, value.empty() ? "" : value.data(), value.size(),
                                SQLITE_TRANSIENT, SQLITE_UTF8);
  return *this;
}
Query& Query::bind(std::span<const std::byte> value) {
  if (code_ == SQLITE_OK)
    code_ = value.empty()
                ? sqlite3_bind_zeroblob(statement_, ++bound_, 0)
                : sqlite3_bind_blob64(statement_, ++bound_, value.data(), value.size(), SQLITE_TRANSIENT);
  return *this;
}

Expected<bool> Query::next() {
  if (code_ != SQLITE_OK) return database_.error(code_);
  KILN_CHECK(statement_ && bound_ == sqlite3_bind_parameter_count(statement_));
  column_ = 0;
  const int code = sqlite3_step(statement_);
  if (code == SQLITE_ROW) return true;
  if (code == SQLITE_DONE) return false;
  return database_.error(code);
}

int64_t Query::integer() {
  KILN_CHECK(column_ < sqlite3_column_count(statement_));
  return sqlite3_column_int64(statement_, column_++);
}
double Query::real() {
  KILN_CHECK(column_ < sqlite3_column_count(statement_));
  return sqlite3_column_double(statement_, column_++);
}
std::string Query::string() {
  KILN_CHECK(column_ < sqlite3_column_count(statement_));
  const auto* text = sqlite3_column_text(statement_, column_);
  const int size = sqlite3_column_bytes(statement_, column_++);
  return text ? std::string(reinterpret_cast<const char*>(text), static_cast<size_t>(size)) : std::string();
}
std::span<const std::byte> Query::blob() {
  KILN_CHECK(column_ < sqlite3_column_count(statement_));
  const void* data = sqlite3_column_blob(statement_, column_);
  const int size = sqlite3_column_bytes(statement_, column_++);
  return {static_cast<const std::byte*>(data), data ? static_cast<size_t>(size) : 0};
}
Digest Query::digest() {
  Digest digest;
  if (const auto bytes = blob(); bytes.size() == digest.bytes.size())
    std::memcpy(digest.bytes.data(), bytes.data(), bytes.size());
  return digest;
}

Expected<Database> Database::open(const fs::path& path) {
  sqlite3* handle = nullptr;
  const int code = sqlite3_open_v2(path.c_str(), &handle,
                                   SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, nullptr);
  Database database(path, handle);
  if (code != SQLITE_OK) return database.error(code);
  sqlite3_extended_result_codes(handle, 1);
  // Exclusive mode needs no shared memory and keeps out processes that ignore our lock. Only checkpoint()
  // empties the log, so that its errors are visible.
  KILN_TRY_STATUS(
      database.script("PRAGMA locking_mode=EXCLUSIVE; PRAGMA journal_mode=WAL; PRAGMA synchronous=FULL;"
                      "PRAGMA wal_autocheckpoint=0; PRAGMA cell_size_check=ON; PRAGMA trusted_schema=OFF;"));
  return database;
}

Database::Database(Database&& other) noexcept
    : path_(std::move(other.path_)),
      handle_(std::exchange(other.handle_, nullptr)),
      statements_(std::move(other.statements_)) {
  other.statements_.clear();
}

void Database::close() {
  for (const auto& [sql, statement] : statements_) sqlite3_finalize(statement);
  statements_.clear();
  sqlite3_close(std::exchange(handle_, nullptr));
}

Query Database::prepared(const char* sql) {
  KILN_CHECK(handle_ != nullptr);
  sqlite3_stmt*& statement = statements_[sql];
  int code = SQLITE_OK;
  if (!statement) code = sqlite3_prepare_v3(handle_, sql, -1, SQLITE_PREPARE_PERSISTENT, &statement, nullptr);
  return Query(*this, statement, code);
}

Status Database::script(const std::string& sql) {
  if (const int code = sqlite3_exec(handle_, sql.c_str(), nullptr, nullptr, nullptr); code != SQLITE_OK)
    return error(code);
  return {};
}

Status Database::begin() {
  return run("BEGIN IMMEDIATE");
}
Status Database::commit() {
  return run("COMMIT");
}
void Database::rollback() {
  // After some errors SQLite has already rolled back. If this fails, the next recovery undoes the changes.
  if (!sqlite3_get_autocommit(handle_)) (void)run("ROLLBACK");
}

uint64_t Database::last_id() const {
  return static_cast<uint64_t>(sqlite3_last_insert_rowid(handle_));
}
uint64_t Database::changes() const {
  return static_cast<uint64_t>(sqlite3_changes64(handle_));
}

uint64_t Database::wal_size() const {
  std::error_code code;
  const uint64_t size = fs::file_size(path_.string() + "-wal", code);
  return code ? 0 : size;
}

Status Database::checkpoint() {
  const int code = sqlite3_wal_checkpoint_v2(handle_, nullptr, SQLITE_CHECKPOINT_TRUNCATE, nullptr, nullptr);
  if (code != SQLITE_OK) return error(code);
  return {};
}

// SQLite's online backup, in one step: this connection is the only writer.
Status Database::copy_to(const fs::path& path) {
  KILN_TRY(Database copy, open(path));
  sqlite3_backup* backup = sqlite3_backup_init(copy.handle_, "main", handle_, "main");
  if (!backup) return copy.error(sqlite3_errcode(copy.handle_));
  const int stepped = sqlite3_backup_step(backup, -1);
  (void)sqlite3_backup_finish(backup);  // says no more than the only step
  if (stepped != SQLITE_DONE) return copy.error(stepped);
  return copy.checkpoint();
}

tl::unexpected<Error> Database::error(int code) const {
  const std::string reason = handle_ ? sqlite3_errmsg(handle_) : sqlite3_errstr(code);
  ErrorKind kind = ErrorKind::kInternal;
  switch (code & 0xff) {
    case SQLITE_FULL:
      kind = ErrorKind::kNoSpace;
      break;
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      kind = ErrorKind::kUnavailable;
      break;
    case SQLITE_IOERR:
    case SQLITE_READONLY:
    case SQLITE_CANTOPEN:
    case SQLITE_CORRUPT:
    case SQLITE_NOTADB:
    case SQLITE_PERM:
    case SQLITE_PROTOCOL:
      kind = ErrorKind::kIo;
      break;
    case SQLITE_NOMEM:
      kind = ErrorKind::kNoSpace;
      break;
  }
  return fail(kind, text("the database {}: {} (SQLite {})", path_.string(), reason, code));
}

Expected<DatabaseHeader> read_database_header(const fs::path& path) {
  const OpenFile file(path, O_RDONLY);
  if (!file.is_open()) return system_error("open", path);
  // SQLite file format, section 1.3: big-endian, user version at 60, application id at 68.
  std::byte head[100];
  KILN_TRY_STATUS(file.read_at(head, 0));
  if (std::memcmp(head, "SQLite format 3", 16) != 0)
    return fail(ErrorKind::kIo, text("{} is not a database", path.string()));
  const auto number = [&](size_t at) {
    uint32_t value = 0;
    for (size_t i = 0; i < 4; ++i) value = value << 8 | std::to_integer<uint32_t>(head[at + i]);
    return value;
  };
  return DatabaseHeader{number(60), number(68)};
}

}  // namespace kiln
