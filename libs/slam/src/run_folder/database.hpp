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

/// The database file session.db of a run. To be used by one thread.
class Database {
 public:
  enum class Access { read, write, create };

  /// Opens or creates the file. An existing file must contain exactly the tables that the program creates, in
  /// its own version, without views or triggers (statistics of ANALYZE are ignored). A reader creates no
  /// files and sees one consistent state. What a writer has committed survives kill -9 and a power loss
  /// (write-ahead log). `scan` is a number that identifies a new file, so that a write-ahead log of another
  /// file is refused. Throws Error.
  Database(std::filesystem::path file, Access access, std::uint32_t scan = 0);

  /// Calls `work` with the connection. Exceptions of SQLite and refuse() are converted to an Error that names
  /// the file.
  template <typename Work>
  auto with(const Work& work) {
    try {
      return work(*connection_);
    } catch (const SQLite::Exception& error) {
      fail(error);
    }
  }
  /// Runs `work` in one transaction, so that everything or nothing is written.
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

/// To be called within Database::with(): throws with the reason why a file is refused.
[[noreturn]] inline void refuse(const std::string& why) { throw SQLite::Exception(why); }

/// Marks a string that is bound as a BLOB and not as TEXT.
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

/// Runs a statement with the given values in place of its question marks.
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

/// Array of numbers stored as a BLOB, followed by a checksum (docs/file-formats.md).
template <std::size_t count>
using Numbers = std::array<double, count>;

inline std::string word(EdgeKind kind) { return kind == EdgeKind::loop ? "loop" : "odometry"; }

/// session.db of a run. Throws Error when there is none, or something else is in its place.
std::filesystem::path session_file(const std::filesystem::path& run);

}  // namespace gelslam::slam::detail
