#include "run_folder/database.hpp"

#include <fmt/format.h>

#include <cmath>
#include <cstring>
#include <fstream>
#include <utility>

#include "gelslam/core/error.hpp"

namespace gelslam::slam::detail {
namespace {

namespace fs = std::filesystem;

constexpr int kApplicationId = 0x47534C4D;  // layout: GSLM
constexpr int kVersion = 5;                 // layout
constexpr int kVersions = 256;              // layout: beyond it is the scan's own number
constexpr int kLargestValueBytes = 1 << 28, kBusyMs = 10'000;

/// docs/file-formats.md has their meaning.
constexpr std::array kTables = {
    "CREATE TABLE parts(id INTEGER PRIMARY KEY, first_frame INTEGER, sensor TEXT, model_crc32 INTEGER, log "
    "TEXT)",
    "CREATE TABLE frames(frame INTEGER PRIMARY KEY, time_s REAL, status TEXT, trial INTEGER, keyframe "
    "INTEGER, "
    "keyframe_T_frame BLOB, observable INTEGER, unix_us INTEGER)",
    "CREATE TABLE keyframes(id INTEGER PRIMARY KEY, frame INTEGER, trial INTEGER, surface BLOB)",
    "CREATE TABLE edges(id INTEGER PRIMARY KEY, from_keyframe INTEGER, to_keyframe INTEGER, kind TEXT, "
    "from_T_to BLOB, information BLOB, shared_center_mm BLOB, tentative INTEGER)",
    "CREATE TABLE searched(keyframe INTEGER PRIMARY KEY)",
    "CREATE TABLE map(gradient_scale REAL, last_frame INTEGER)",
    "CREATE TABLE poses(keyframe INTEGER PRIMARY KEY, component INTEGER, in_map INTEGER, pose BLOB)",
    "CREATE TABLE map_edges(id INTEGER PRIMARY KEY, from_keyframe INTEGER, to_keyframe INTEGER, kind TEXT, "
    "outlier INTEGER)"};

constexpr const char* kNotASession = "damaged, or not a session of gelslam";

/// A name that SQLite takes options from.
std::string uri_of(const fs::path& file, bool never_changes) {
  std::string uri = "file://";
  for (const char c : fs::absolute(file).string())
    uri += std::strchr("%?#", c) ? fmt::format("%{:02X}", static_cast<unsigned char>(c)) : std::string(1, c);
  return uri + (never_changes ? "?immutable=1" : "");
}

/// Nobody has written since the last writer has closed it: it can be read without a lock or a file beside it.
bool is_at_rest(const fs::path& file) {
  std::error_code code;
  const std::uintmax_t bytes = fs::file_size(file.string() + "-wal", code);
  return code || bytes == 0;
}

/// What the file itself says, whatever a write-ahead log does: its user version.
std::int64_t mark_in(const fs::path& file) {
  std::array<unsigned char, 4> bytes{};
  std::ifstream(file, std::ios::binary).seekg(60).read(reinterpret_cast<char*>(bytes.data()), bytes.size());
  return bytes[0] << 24 | bytes[1] << 16 | bytes[2] << 8 | bytes[3];
}

}  // namespace

Database::Database(fs::path file, Access access, std::uint32_t scan)
    : file_(std::move(file)), access_(access) {
  try {
    open(scan);
  } catch (const Error&) {
    close();
    throw;
  }
}

void Database::close() { sqlite3_close(std::exchange(connection_, nullptr)); }

void Database::open(std::uint32_t scan) {
  int flags = SQLITE_OPEN_NOMUTEX | SQLITE_OPEN_URI | SQLITE_OPEN_READONLY;
  if (access_ != Access::read) flags ^= SQLITE_OPEN_READONLY ^ SQLITE_OPEN_READWRITE;
  if (access_ == Access::create) flags |= SQLITE_OPEN_CREATE;
  const std::string uri = uri_of(file_, access_ == Access::read && is_at_rest(file_));
  if (sqlite3_open_v2(uri.c_str(), &connection_, flags, nullptr) != SQLITE_OK) fail();
  sqlite3_busy_timeout(connection_, kBusyMs);
  sqlite3_limit(connection_, SQLITE_LIMIT_LENGTH, kLargestValueBytes);
  for (const auto& [option, value] : {std::pair(SQLITE_DBCONFIG_DEFENSIVE, 1),
                                      {SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0},
                                      {SQLITE_DBCONFIG_ENABLE_TRIGGER, 0},
                                      {SQLITE_DBCONFIG_ENABLE_VIEW, 0}})
    sqlite3_db_config(connection_, option, value, nullptr);
  execute("PRAGMA cell_size_check=ON");
  if (access_ == Access::create) {
    make_tables(scan);
  } else {
    if (access_ == Access::read) execute("BEGIN");  // all that is read is of one moment
    check_tables();
  }
  if (access_ != Access::write) return;
  execute("PRAGMA synchronous=FULL");
  if (journal_mode("PRAGMA journal_mode") == "wal") return;
  journal_mode("PRAGMA journal_mode=MEMORY");  // else a journal is made for the next step
  if (journal_mode("PRAGMA journal_mode=WAL") != "wal") fail("its disk takes no write-ahead log of SQLite");
}

std::string Database::journal_mode(const char* pragma) {
  Statement statement(*this, pragma);
  return statement.next() ? statement.text(0) : "";
}

/// Of a new file, which goes if this fails.
void Database::make_tables(std::uint32_t scan) {
  execute("PRAGMA journal_mode=MEMORY");
  transact([&] {
    execute(fmt::format("PRAGMA application_id={}", kApplicationId).c_str());
    execute(fmt::format("PRAGMA user_version={}", scan % (1U << 23) * kVersions + kVersion).c_str());
    for (const char* table : kTables) execute(table);
  });
}

void Database::check_tables() {
  if (pragma("application_id") != kApplicationId) fail(kNotASession);
  const std::int64_t mark = pragma("user_version"), version = mark % kVersions;
  if (mark != mark_in(file_)) fail("the session.db-wal beside it is of another run; remove that");
  if (version != kVersion)
    fail(fmt::format("written by {} version of the program (session version {}, this one reads {}); {}",
                     version < kVersion ? "an older" : "a newer", version, kVersion,
                     version < kVersion ? "reconstruct the log again" : "update gelslam"));
  Statement tables(*this, "SELECT sql FROM sqlite_schema WHERE name NOT GLOB 'sqlite_stat?'");  // of ANALYZE
  std::size_t found = 0;
  for (; tables.next(); ++found)
    if (found == kTables.size() || tables.text(0) != kTables[found]) fail(kNotASession);
  if (found != kTables.size()) fail(kNotASession);
}

std::int64_t Database::pragma(const char* name) {
  Statement statement(*this, fmt::format("PRAGMA {}", name).c_str());
  return statement.next() ? statement.integer(0, INT32_MIN, std::int64_t{INT32_MAX}) : 0;
}

void Database::execute(const char* sql) {
  if (sqlite3_exec(connection_, sql, nullptr, nullptr, nullptr) != SQLITE_OK) fail();
}

void Database::copy_to(const fs::path& file) {
  Database target(file, Access::create);
  sqlite3_backup* backup = sqlite3_backup_init(target.connection_, "main", connection_, "main");
  if (backup == nullptr) target.fail();
  const int step = sqlite3_backup_step(backup, -1);
  if (sqlite3_backup_finish(backup) != SQLITE_OK || step != SQLITE_DONE) target.fail();
}

void Database::fail(const std::string& why) const { throw Error(file_.string() + ": " + why); }

void Database::fail() {
  const int code = sqlite3_errcode(connection_) & 0xFF;
  if (code == SQLITE_BUSY) fail("another program is using it");
  for (const int damage : {SQLITE_CORRUPT, SQLITE_NOTADB, SQLITE_ERROR, SQLITE_TOOBIG, SQLITE_CONSTRAINT})
    if (code == damage) fail(kNotASession);
  const bool of_system = code == SQLITE_IOERR || code == SQLITE_CANTOPEN;
  fail(std::string(access_ == Access::read ? "cannot be read: " : "cannot be written: ") +
       (of_system ? std::strerror(sqlite3_system_errno(connection_)) : sqlite3_errstr(code)));
}

Statement::Statement(Database& database, const char* sql) : database_(database) {
  if (sqlite3_prepare_v2(database_.connection_, sql, -1, &statement_, nullptr) != SQLITE_OK) database_.fail();
}

bool Statement::next() {
  const int step = sqlite3_step(statement_);
  if (step != SQLITE_ROW && step != SQLITE_DONE) database_.fail();
  return step == SQLITE_ROW;
}

void Statement::bind(int place, std::string_view text) {
  sqlite3_bind_text64(statement_, place, text.data(), text.size(), SQLITE_STATIC, SQLITE_UTF8);
}

void Statement::bind(int place, const Blob& blob) {
  sqlite3_bind_blob64(statement_, place, blob.bytes.data(), blob.bytes.size(), SQLITE_STATIC);
}

void Statement::require(int column, int type) const {
  if (sqlite3_column_type(statement_, column) != type) database_.fail(kNotASession);
}

std::int64_t Statement::integer(int column, std::int64_t least, std::int64_t most) const {
  require(column, SQLITE_INTEGER);
  const std::int64_t value = sqlite3_column_int64(statement_, column);
  if (value < least || value > most) database_.fail("holds an impossible number");
  return value;
}

double Statement::number(int column, double most) const {
  require(column, SQLITE_FLOAT);
  const double value = sqlite3_column_double(statement_, column);
  if (!(std::abs(value) <= most)) database_.fail("holds an impossible number");
  return value;
}

std::string Statement::text(int column) const {
  require(column, SQLITE_TEXT);
  return {reinterpret_cast<const char*>(sqlite3_column_text(statement_, column)),
          static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
}

std::string_view Statement::blob(int column) const {
  require(column, SQLITE_BLOB);
  return {static_cast<const char*>(sqlite3_column_blob(statement_, column)),
          static_cast<std::size_t>(sqlite3_column_bytes(statement_, column))};
}

}  // namespace gelslam::slam::detail
