#pragma once

#include <gtest/gtest.h>
#include <sqlite3.h>

#include <filesystem>
#include <string>

namespace gelslam::test {

/// Runs SQL on a database, as any program may. Returns what it gives: a line per row, columns with | between.
inline std::string sql(const std::filesystem::path& file, const std::string& statements) {
  sqlite3* database = nullptr;
  EXPECT_EQ(sqlite3_open_v2(file.c_str(), &database, SQLITE_OPEN_READWRITE, nullptr), SQLITE_OK) << file;
  sqlite3_busy_timeout(database, 5000);  // a scan may be beginning its file
  std::string rows;
  const auto add = [](void* all, int columns, char** values, char**) {
    auto& text = *static_cast<std::string*>(all);
    for (int i = 0; i < columns; ++i) text += std::string(i > 0 ? "|" : "") + (values[i] ? values[i] : "");
    text += '\n';
    return 0;
  };
  EXPECT_EQ(sqlite3_exec(database, statements.c_str(), add, &rows, nullptr), SQLITE_OK)
      << statements << ": " << sqlite3_errmsg(database);
  sqlite3_close(database);
  return rows;
}

}  // namespace gelslam::test
