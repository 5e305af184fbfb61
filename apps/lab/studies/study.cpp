#include "study.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <ctime>
#include <iostream>

#include "baselines/baselines.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam::lab {
namespace {

std::string table_cell(const Json& value) {
  if (value.is_string()) return value.get<std::string>();
  if (value.is_number_float()) return fmt::format("{:.4g}", value.get<double>());
  return value.is_null() ? "-" : value.dump();
}

}  // namespace

void check_methods(const std::vector<std::string>& methods) {
  for (const std::string& method : methods) make_registrar(method, {});
}

double thread_cpu_ms() {
  timespec now{};
  clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);
  return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
}

void StudyCases::begin(const std::string& name) {
  const double seconds = std::chrono::duration<double>(Clock::now() - start_).count();
  const auto done = static_cast<double>(begun_++);
  std::cerr << begun_ << "/" << total_ << "  " << name;
  if (done > 0)
    std::cerr << ", " << duration_text(seconds * (static_cast<double>(total_) / done - 1)) << " left";
  std::cerr << std::endl;
}

void write_study(const std::filesystem::path& folder, const std::string& name, const Json& rows) {
  if (folder.empty()) return;
  std::error_code failure;
  std::filesystem::create_directories(folder, failure);
  if (failure) throw Error("cannot make folder " + folder.string() + ": " + failure.message());
  write_file_atomically(folder / (name + ".json"), rows.dump(1) + "\n");
}

void print_table(const Json& rows) {
  if (rows.empty()) return;
  std::vector<std::vector<std::string>> lines(1);
  std::vector<bool> is_text;
  for (const auto& [key, value] : rows.front().items()) {
    lines[0].push_back(key);
    is_text.push_back(value.is_string());
  }
  for (const Json& row : rows) {
    lines.emplace_back();
    for (const auto& [key, value] : row.items()) lines.back().push_back(table_cell(value));
  }
  std::vector<std::size_t> widths(is_text.size(), 0);
  for (const auto& line : lines)
    for (std::size_t k = 0; k < line.size(); ++k) widths[k] = std::max(widths[k], line[k].size());
  for (const auto& line : lines) {
    for (std::size_t k = 0; k < line.size(); ++k) {
      const std::string padding(widths[k] - line[k].size(), ' ');
      std::cout << (k == 0 ? "" : "  ") << (is_text[k] ? line[k] + padding : padding + line[k]);
    }
    std::cout << "\n";
  }
  std::cout << std::flush;
}

}  // namespace gelslam::lab
