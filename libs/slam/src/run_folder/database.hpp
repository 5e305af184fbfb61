#pragma once

#include <sqlite3.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <optional>
#include <string>
#include <string_view>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam::slam::detail {

/// A connection to session.db, for one thread. What fails throws Error, naming the file.
class Database {
 public:
  enum class Access { read, write, create };

  /// A file that is read or written has to hold the tables that create() makes, and nothing else: no view or
  /// trigger, and no other version; what ANALYZE adds is passed over. Who reads makes no file. Who writes
  /// keeps what was committed after kill -9 and a power loss (write-ahead log). `scan`: a number of its own
  /// for a file that is made, by which the write-ahead log of another one is refused.
  Database(std::filesystem::path file, Access access, std::uint32_t scan = 0);
  ~Database() { close(); }
  Database(const Database&) = delete;
  Database& operator=(const Database&) = delete;

  void execute(const char* sql);
  /// All that `work` writes, or nothing.
  template <typename Work>
  void transact(const Work& work) {
    execute("BEGIN IMMEDIATE");
    try {
      work();
      execute("COMMIT");
    } catch (...) {
      sqlite3_exec(connection_, "ROLLBACK", nullptr, nullptr,
                   nullptr);  // where SQLite has not done it itself
      throw;
    }
  }
  void copy_to(const std::filesystem::path& file);
  [[noreturn]] void fail();
  [[noreturn]] void fail(const std::string& why) const;

 private:
  friend class Statement;
  void open(std::uint32_t scan);
  void close();
  void make_tables(std::uint32_t scan);
  void check_tables();
  std::int64_t pragma(const char* name);
  std::string journal_mode(const char* pragma);

  const std::filesystem::path file_;
  const Access access_;
  sqlite3* connection_ = nullptr;
};

/// Bytes, unlike text.
struct Blob {
  std::string bytes;
};

class Statement {
 public:
  Statement(Database& database, const char* sql);
  ~Statement() { sqlite3_finalize(statement_); }
  Statement(const Statement&) = delete;
  Statement& operator=(const Statement&) = delete;

  /// Runs it with these values in the place of its question marks; they are only used meanwhile.
  template <typename... Values>
  void run(const Values&... values) {
    int place = 0;
    (bind(++place, values), ...);
    while (next()) {
    }
    sqlite3_reset(statement_);
  }

  /// False: there is no further row.
  bool next();

  [[noreturn]] void fail(const std::string& why) const { database_.fail(why); }

  // A column of the row. Throws Error for another type, and for numbers that are not within the bounds.
  bool is_null(int column) const { return sqlite3_column_type(statement_, column) == SQLITE_NULL; }
  std::int64_t integer(int column, std::int64_t least, std::int64_t most) const;
  template <typename Integer>
  Integer integer(int column, std::int64_t least, Integer most) const {
    return static_cast<Integer>(integer(column, least, std::int64_t{most}));
  }
  double number(int column, double most) const;  ///< within +-most
  std::string text(int column) const;
  std::string_view blob(int column) const;  ///< until next()

 private:
  void bind(int place, std::int64_t value) { sqlite3_bind_int64(statement_, place, value); }
  void bind(int place, int value) { sqlite3_bind_int64(statement_, place, value); }
  void bind(int place, double value) { sqlite3_bind_double(statement_, place, value); }
  template <typename Value>
  void bind(int place, const std::optional<Value>& value) {
    if (value)
      bind(place, *value);
    else
      sqlite3_bind_null(statement_, place);
  }
  void bind(int place, std::string_view text);
  void bind(int place, const Blob& blob);
  void require(int column, int type) const;

  Database& database_;
  sqlite3_stmt* statement_ = nullptr;
};

/// Numbers in a row of session.db, as docs/file-formats.md says. There a checksum follows them.
template <std::size_t count>
using Numbers = std::array<double, count>;

inline std::string_view word(EdgeKind kind) { return kind == EdgeKind::loop ? "loop" : "odometry"; }

/// session.db of a run. Throws Error when there is none, or something else is in its place.
std::filesystem::path session_file(const std::filesystem::path& run);

}  // namespace gelslam::slam::detail
