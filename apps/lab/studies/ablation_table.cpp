#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <numeric>

#include "ablation_case.hpp"

namespace gelslam::lab {
namespace {

using Key = std::vector<std::string>;

Key key_of(const Json& row) { return {row["set"], row["sequence"], row["model"]}; }

/// Null where one of both is missing.
Json ratio(const Json& without, const Json& with) {
  constexpr double kLeast = 1e-9;
  if (!without.is_number() || !with.is_number()) return nullptr;
  const double ratio = std::max(without.get<double>(), kLeast) / std::max(with.get<double>(), kLeast);
  return std::isfinite(ratio) ? Json(ratio) : Json(nullptr);
}

Json compared(const Json& with, const Json& without) {
  Json row = {{"without", without["variant"]},
              {"set", with["set"]},
              {"model", with["model"]},
              {"sequence", with["sequence"]}};
  for (const char* quantity : {"error", "mesh"})
    row[quantity] = ratio(without[std::string(quantity) + "_mm"], with[std::string(quantity) + "_mm"]);
  for (const char* time : {"frame", "finish"})
    row[std::string(time) + "_time"] =
        ratio(without[std::string(time) + "_ms"], with[std::string(time) + "_ms"]);
  for (const char* count :
       {"error_mm", "share", "tracked", "pieces", "loops", "silent", "error_over_sigma"}) {
    row[std::string(count) + "_with"] = with[count];
    row[std::string(count) + "_without"] = without[count];
  }
  return row;
}

using Rows = std::vector<const Json*>;

/// Of the rows that have a number.
std::vector<double> numbers(const Rows& rows, const std::string& column) {
  std::vector<double> numbers;
  for (const Json* row : rows)
    if ((*row)[column].is_number()) numbers.push_back((*row)[column].get<double>());
  return numbers;
}

Json sum(const Rows& rows, const char* column) {
  const std::vector<double> all = numbers(rows, column);
  return all.empty() ? Json() : Json(std::llround(std::accumulate(all.begin(), all.end(), 0.0)));
}

Json mean(const Rows& rows, const char* column) {
  const std::vector<double> all = numbers(rows, column);
  return all.empty() ? Json()
                     : Json(std::accumulate(all.begin(), all.end(), 0.0) / static_cast<double>(all.size()));
}

Json geometric_mean(const Rows& rows, const char* column) {
  const std::vector<double> all = numbers(rows, column);
  double sum = 0;
  for (const double value : all) sum += std::log(std::max(value, 1e-9));
  return all.empty() ? Json() : Json(std::exp(sum / static_cast<double>(all.size())));
}

/// The smallest or largest error ratio and whose it is.
std::string extreme(const Rows& rows, bool largest) {
  std::vector<std::pair<double, std::string>> errors;
  for (const Json* row : rows)
    if ((*row)["error"].is_number()) errors.emplace_back((*row)["error"], (*row)["sequence"]);
  if (errors.empty()) return "-";
  const auto& [value, sequence] = largest ? *std::max_element(errors.begin(), errors.end())
                                          : *std::min_element(errors.begin(), errors.end());
  return fmt::format("{:.2f} {}", value, sequence);
}

Json summary(const Key& key, const Rows& rows) {
  return {{"without", key[0]},
          {"set", key[1]},
          {"model", key[2]},
          {"logs", rows.size()},
          {"error", geometric_mean(rows, "error")},
          {"worst", extreme(rows, false)},
          {"best", extreme(rows, true)},
          {"share_with", mean(rows, "share_with")},
          {"share_without", mean(rows, "share_without")},
          {"silent_with", sum(rows, "silent_with")},
          {"silent_without", sum(rows, "silent_without")},
          {"mesh", geometric_mean(rows, "mesh")},
          {"sigma_with", geometric_mean(rows, "error_over_sigma_with")},
          {"sigma_without", geometric_mean(rows, "error_over_sigma_without")},
          {"loops_with", sum(rows, "loops_with")},
          {"loops_without", sum(rows, "loops_without")},
          {"frame_time", geometric_mean(rows, "frame_time")},
          {"finish_time", geometric_mean(rows, "finish_time")}};
}

}  // namespace

Json ablation_ratios(const Json& rows, const std::string& baseline) {
  std::map<Key, const Json*> with;
  for (const Json& row : rows)
    if (row["variant"] == baseline) with.try_emplace(key_of(row), &row);
  Json ratios = Json::array();
  for (const Json& row : rows) {
    const auto found = with.find(key_of(row));
    if (row["variant"] != baseline && found != with.end()) ratios.push_back(compared(*found->second, row));
  }
  return ratios;
}

Json ablation_table(const Json& ratios) {
  std::vector<Key> keys;  // in the order in which they come, "all" of a variant after its sets
  std::map<Key, Rows> rows;
  const auto add = [&](const Key& key, const Json& row) {
    if (rows.find(key) == rows.end()) keys.push_back(key);
    rows[key].push_back(&row);
  };
  for (const Json& row : ratios) add({row["without"], row["set"], row["model"]}, row);
  const std::size_t sets = keys.size();
  for (const Json& row : ratios) add({row["without"], "all", row["model"]}, row);
  std::vector<Key> variants(keys.begin() + static_cast<std::ptrdiff_t>(sets), keys.end());
  keys.resize(sets);
  Json table = Json::array();
  for (const Key& all : variants) {
    for (const Key& key : keys)
      if (key[0] == all[0] && key[2] == all[2]) table.push_back(summary(key, rows[key]));
    table.push_back(summary(all, rows[all]));
  }
  return table;
}

}  // namespace gelslam::lab
