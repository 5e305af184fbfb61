#pragma once

#include <SQLiteCpp/Database.h>
#include <SQLiteCpp/Exception.h>
#include <SQLiteCpp/Statement.h>
#include <SQLiteCpp/Transaction.h>

#include <array>
#include <cstdint>
#include <filesystem>
#include <memory>
#include <optional>
#include <string>

#include "gelslam/backend/pose_graph.hpp"

namespace gelslam::slam::detail {

/// session.db of a run, for one thread.
class Database {
 public:
  enum class Access { read, write, create };

  /// A file that is read or written has to hold the tables that a new one gets, and nothing else: no view or
  /// trigger, and no other version; what ANALYZE adds is passed over. Who reads makes no file, and sees one
  /// moment. Who writes keeps what was committed after kill -9 and a power loss (write-ahead log). `scan`: a
  /// number of its own for a file that is made, by which the write-ahead log of another one is refused.
  /// Throws Error.
  Database(std::filesystem::path file, Access access, std::uint32_t scan = 0);

  /// Gives `work` the connection. What SQLite throws, and refuse(), becomes an Error that names the file.
  template <typename Work>
  auto with(const Work& work) {
    try {
      return work(*connection_);
    } catch (const SQLite::Exception& error) {
      fail(error);
    }
  }
  /// All that `work` writes, or nothing.
  template <typename Work>
  void transact(const Work& work) {
    with([&](SQLite::Database& connection) {
      SQLite::Transaction transaction(connection, SQLite::TransactionBehavior::IMMEDIATE);
      work(connection);
      transaction.commit();
    });
  }

 private:
  void open(std::uint32_t scan);
  void make_tables(std::uint32_t scan);
  void check_tables();
  [[noreturn]] void fail(const SQLite::Exception& error) const;

  const std::filesystem::path file_;
  const Access access_;
  std::unique_ptr<SQLite::Database> connection_;
};

inline constexpr const char* kNotASession = "damaged, or not a session of gelslam";

/// What is wrong with a file, within Database::with().
[[noreturn]] inline void refuse(const std::string& why) { throw SQLite::Exception(why); }

/// Bytes, unlike text.
struct Blob {
  std::string bytes;
};

template <typename Value>
void bind(SQLite::Statement& statement, int place, const Value& value) {
  statement.bind(place, value);
}
inline void bind(SQLite::Statement& statement, int place, const Blob& blob) {
  statement.bindNoCopy(place, blob.bytes.data(), static_cast<int>(blob.bytes.size()));
}
template <typename Value>
void bind(SQLite::Statement& statement, int place, const std::optional<Value>& value) {
  value ? bind(statement, place, *value) : statement.bind(place);  // NULL
}

/// Runs a statement with these values in the place of its question marks.
template <typename... Values>
void run(SQLite::Statement& statement, const Values&... values) {
  int place = 0;
  (bind(statement, ++place, values), ...);
  statement.exec();
  statement.reset();
}
template <typename... Values>
void run(SQLite::Database& database, const char* sql, const Values&... values) {
  SQLite::Statement statement(database, sql);
  run(statement, values...);
}

/// Numbers in a row of session.db, as docs/file-formats.md says. There a checksum follows them.
template <std::size_t count>
using Numbers = std::array<double, count>;

inline std::string word(EdgeKind kind) { return kind == EdgeKind::loop ? "loop" : "odometry"; }

/// session.db of a run. Throws Error when there is none, or something else is in its place.
std::filesystem::path session_file(const std::filesystem::path& run);

}  // namespace gelslam::slam::detail
