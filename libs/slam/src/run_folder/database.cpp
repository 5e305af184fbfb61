#include "run_folder/database.hpp"

#include <fmt/format.h>
#include <sqlite3.h>

#include <cerrno>
#include <cstring>
#include <fstream>
#include <set>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/file_descriptor.hpp"

namespace gelslam::slam::detail {
namespace {

namespace fs = std::filesystem;

constexpr int kApplicationId = 0x47534C4D;  // "GSLM" in ASCII
constexpr int kVersion = 6;
// The higher bits of the user version contain a number that identifies the scan.
constexpr int kVersions = 256;
constexpr int kLargestValueBytes = 1 << 28, kBusyMs = 10'000;

/// The columns are described in docs/file-formats.md.
constexpr std::array kTables = {
    "CREATE TABLE parts(id INTEGER PRIMARY KEY, first_frame INTEGER, sensor TEXT, model_crc32 INTEGER, log "
    "TEXT)",
    "CREATE TABLE frames(frame INTEGER PRIMARY KEY, time_s REAL, status TEXT, trial INTEGER, keyframe "
    "INTEGER, "
    "keyframe_T_frame BLOB, covariance BLOB, shared_center_mm BLOB, observable INTEGER, unix_us INTEGER)",
    "CREATE TABLE keyframes(id INTEGER PRIMARY KEY, frame INTEGER, trial INTEGER, surface BLOB)",
    "CREATE TABLE edges(id INTEGER PRIMARY KEY, from_keyframe INTEGER, to_keyframe INTEGER, kind TEXT, "
    "from_T_to BLOB, information BLOB, shared_center_mm BLOB, tentative INTEGER)",
    "CREATE TABLE searched(keyframe INTEGER PRIMARY KEY)",
    "CREATE TABLE map(gradient_scale REAL, last_frame INTEGER)",
    "CREATE TABLE poses(keyframe INTEGER PRIMARY KEY, component INTEGER, in_map INTEGER, pose BLOB)",
    "CREATE TABLE map_edges(id INTEGER PRIMARY KEY, from_keyframe INTEGER, to_keyframe INTEGER, kind TEXT, "
    "outlier INTEGER)"};

/// Returns the file name as a URI, which can hold options for SQLite.
std::string uri_of(const fs::path& file, bool never_changes) {
  std::string uri = "file://";
  for (const char c : fs::absolute(file).string())
    uri += std::strchr("%?#", c) ? fmt::format("%{:02X}", static_cast<unsigned char>(c)) : std::string(1, c);
  return uri + (never_changes ? "?immutable=1" : "");
}

/// True if the last writer has closed the file and no write-ahead log is left. The file can then be read
/// without a lock and without auxiliary files.
bool is_at_rest(const fs::path& file) {
  std::error_code code;
  const std::uintmax_t bytes = fs::file_size(file.string() + "-wal", code);
  return code || bytes == 0;
}

/// Reads the user version directly from the file's header, without the write-ahead log.
std::int64_t mark_in(const fs::path& file) {
  std::array<unsigned char, 4> bytes{};
  if (!std::ifstream(file, std::ios::binary)
           .seekg(60)
           .read(reinterpret_cast<char*>(bytes.data()), bytes.size()))
    refuse("cannot be read: " + errno_text());  // This also happens when no file descriptor is free.
  return bytes[0] << 24 | bytes[1] << 16 | bytes[2] << 8 | bytes[3];
}

}  // namespace

Database::Database(fs::path file, Access access, std::uint32_t scan)
    : file_(std::move(file)), access_(access) {
  try {
    open(scan);
  } catch (const SQLite::Exception& error) {
    fail(error);
  }
}

void Database::open(std::uint32_t scan) {
  int flags = SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_URI;
  flags |= access_ == Access::read ? SQLITE_OPEN_READONLY : SQLITE_OPEN_READWRITE;
  if (access_ == Access::create) flags |= SQLITE_OPEN_CREATE;
  const std::string uri = uri_of(file_, access_ == Access::read && is_at_rest(file_));
  connection_ = std::make_unique<SQLite::Database>(uri, flags, kBusyMs);
  sqlite3_limit(connection_->getHandle(), SQLITE_LIMIT_LENGTH, kLargestValueBytes);
  for (const auto& [option, value] : {std::pair(SQLITE_DBCONFIG_DEFENSIVE, 1),
                                      {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                      {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
                                      {SQLITE_DBCONFIG_ENABLE_VIEW, 0}})
    sqlite3_db_config(connection_->getHandle(), option, value, nullptr);
  connection_->exec("PRAGMA cell_size_check=ON");
  if (access_ == Access::create) {
    make_tables(scan);
  } else {
    // One transaction, so that everything read belongs to one state.
    if (access_ == Access::read) connection_->exec("BEGIN");
    check_tables();
  }
  if (access_ != Access::write) return;
  connection_->exec("PRAGMA synchronous=FULL");
  if (connection_->execAndGet("PRAGMA journal_mode").getString() == "wal") return;
  connection_->exec("PRAGMA journal_mode=MEMORY");  // Otherwise the next statement creates a journal file.
  if (connection_->execAndGet("PRAGMA journal_mode=WAL").getString() != "wal")
    refuse("its disk takes no write-ahead log of SQLite");
}

/// Creates the tables of a new file. If this fails, the new file is removed.
void Database::make_tables(std::uint32_t scan) {
  connection_->exec("PRAGMA journal_mode=MEMORY");
  transact([&](SQLite::Database& connection) {
    connection.exec(fmt::format("PRAGMA application_id={}", kApplicationId));
    connection.exec(fmt::format("PRAGMA user_version={}", scan % (1U << 23) * kVersions + kVersion));
    for (const char* table : kTables) connection.exec(table);
  });
}

void Database::check_tables() {
  if (connection_->execAndGet("PRAGMA application_id").getInt() != kApplicationId) refuse(kNotASession);
  const std::int64_t mark = connection_->execAndGet("PRAGMA user_version"), version = mark % kVersions;
  if (mark != mark_in(file_)) refuse("the session.db-wal beside it is of another run; remove that");
  if (version != kVersion)
    refuse(fmt::format("written by {} version of the program (session version {}, this one reads {}); {}",
                       version < kVersion ? "an older" : "a newer", version, kVersion,
                       version < kVersion ? "reconstruct the log again" : "update gelslam"));
  SQLite::Statement tables(*connection_,
                           // sqlite_stat tables come from ANALYZE.
                           "SELECT sql FROM sqlite_schema WHERE name NOT GLOB 'sqlite_stat?'");
  std::size_t found = 0;
  for (; tables.executeStep(); ++found)
    if (found == kTables.size() || tables.getColumn(0).getString() != kTables[found]) refuse(kNotASession);
  if (found != kTables.size()) refuse(kNotASession);
}

void Database::fail(const SQLite::Exception& error) const {
  const int system = connection_ ? sqlite3_system_errno(connection_->getHandle()) : errno;
  const int code = error.getErrorCode() & 0xFF;
  std::string why = error.what();  // The message given to refuse().
  if (code == SQLITE_BUSY) {
    why = "another program is using it";
  } else if (std::set{SQLITE_CORRUPT, SQLITE_NOTADB, SQLITE_ERROR, SQLITE_TOOBIG, SQLITE_CONSTRAINT}.contains(
                 code)) {
    why = kNotASession;
  } else if (error.getErrorCode() >= 0) {
    const bool of_system = (code == SQLITE_IOERR && system != 0) || code == SQLITE_CANTOPEN;
    why = std::string(access_ == Access::read ? "cannot be read: " : "cannot be written: ") +
          (of_system ? std::strerror(system) : error.getErrorStr());
  }
  throw Error(file_.string() + ": " + why);
}

}  // namespace gelslam::slam::detail
