// The part of SQLite that the store uses. Only sqlite.cpp includes SQLite.
//
// Error kinds: kNoSpace and kIo from the disk, kUnavailable when another process holds the file, kInternal
// for statements that SQLite rejects. The message names the file and SQLite's reason.
#pragma once

#include <filesystem>
#include <map>
#include <span>
#include <string>
#include <string_view>

#include "common/base/bytes.h"
#include "common/base/hash.h"
#include "common/base/status.h"

struct sqlite3;
struct sqlite3_stmt;

namespace kiln {

class Database;

// One execution of a prepared statement, released on destruction. Values are bound in order and copied.
// Unsigned 64-bit numbers are stored with the same bits.
class Query {
 public:
  Query(Query&& other) noexcept;
  ~Query();
  Query& bind(int64_t value);
  Query& bind(uint64_t value) { return bind(static_cast<int64_t>(value)); }
  Query& bind(uint32_t value) { return bind(static_cast<int64_t>(value)); }
  Query& bind(int32_t value) { return bind(static_cast<int64_t>(value)); }
  Query& bind(bool value) { return bind(static_cast<int64_t>(value)); }
  Query& bind(double value);
  Query& bind(std::string_view value);
  Query& bind(std::span<const std::byte> value);
  Query& bind(const Digest& value) { return bind(std::as_bytes(std::span(value.bytes))); }

  Expected<bool> next();  // true: there is a row
  // Reads the current row's columns in order.
  int64_t integer();
  uint64_t number() { return static_cast<uint64_t>(integer()); }
  double real();
  std::string string();
  std::span<const std::byte> blob();  // until next()
  Digest digest();                    // zero unless it has 32 bytes

 private:
  friend class Database;
  Query(const Database& database, sqlite3_stmt* statement, int code)
      : database_(database), statement_(statement), code_(code) {}
  const Database& database_;
  sqlite3_stmt* statement_;
  int code_;
  int bound_ = 0, column_ = 0;
};

class Database {
 public:
  // Opens or creates the file, with exclusive access until closed.
  static Expected<Database> open(const std::filesystem::path& path);
  void close();  // afterwards only path() and wal_size() may be called
  Database(Database&& other) noexcept;
  ~Database() { close(); }

  // Runs a statement without results. Its text must be static, because the prepared statement is cached.
  template <class... Values>
  Status run(const char* sql, const Values&... values) {
    Query query = ask(sql, values...);
    KILN_TRY_STATUS(query.next());
    return {};
  }
  // The same for a statement with rows.
  template <class... Values>
  Query ask(const char* sql, const Values&... values) {
    Query query = prepared(sql);
    (query.bind(values), ...);
    return query;
  }
  Status script(const std::string& sql);  // several statements, not cached

  Status begin();  // a transaction that writes
  Status commit();
  void rollback();  // if one is open

  uint64_t last_id() const;
  uint64_t changes() const;  // rows of the last statement
  uint64_t wal_size() const;
  Status copy_to(const std::filesystem::path& path);  // as it is now, into a new file, synced
  Status checkpoint();                                // all of the log into the file, and the log emptied

  const std::filesystem::path& path() const { return path_; }
  tl::unexpected<Error> error(int code) const;

 private:
  Database(std::filesystem::path path, sqlite3* handle) : path_(std::move(path)), handle_(handle) {}
  Query prepared(const char* sql);
  std::filesystem::path path_;
  sqlite3* handle_;
  std::map<const char*, sqlite3_stmt*> statements_;  // by address of the SQL
};

// The schema version and application number in the first bytes of a database file, read without opening it.
struct DatabaseHeader {
  uint32_t user_version = 0, application_id = 0;
};
Expected<DatabaseHeader> read_database_header(const std::filesystem::path& path);

}  // namespace kiln
