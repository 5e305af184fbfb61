#include "study.hpp"

#include <fmt/ranges.h>

#include <ctime>
#include <iostream>

#include "baselines/baselines.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam::lab {
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

void print_csv(const Json& rows) {
  std::vector<std::string> cells;
  if (!rows.empty())
    for (const auto& [key, value] : rows.front().items()) cells.push_back(key);
  std::cout << fmt::format("{}\n", fmt::join(cells, ","));
  for (const Json& row : rows) {
    cells.clear();
    for (const Json& value : row) cells.push_back(value.is_null() ? "" : value.dump());
    std::cout << fmt::format("{}\n", fmt::join(cells, ","));
  }
}

}  // namespace gelslam::lab
