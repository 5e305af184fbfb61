#include "ablation_table.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>

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

/// Of the rows that have a number.
struct Ratios {
  explicit Ratios(const std::vector<const Json*>& rows, const char* quantity) {
    for (const Json* row : rows)
      if ((*row)[quantity].is_number())
        sorted.emplace_back((*row)[quantity].get<double>(), (*row)["sequence"].get<std::string>());
    std::sort(sorted.begin(), sorted.end());
  }

  Json geometric_mean() const {
    if (sorted.empty()) return nullptr;
    double sum = 0;
    for (const auto& [value, sequence] : sorted) sum += std::log(std::max(value, 1e-9));
    return std::exp(sum / static_cast<double>(sorted.size()));
  }
  std::string worst() const { return sorted.empty() ? "-" : text(sorted.front()); }
  std::string best() const { return sorted.empty() ? "-" : text(sorted.back()); }

  std::vector<std::pair<double, std::string>> sorted;

 private:
  static std::string text(const std::pair<double, std::string>& one) {
    return fmt::format("{:.2f} {}", one.first, one.second);
  }
};

Json sum(const std::vector<const Json*>& rows, const char* column) {
  Json sum;
  for (const Json* row : rows)
    if ((*row)[column].is_number())
      sum = (sum.is_null() ? 0 : sum.get<std::int64_t>()) + (*row)[column].get<std::int64_t>();
  return sum;
}

Json mean(const std::vector<const Json*>& rows, const char* column) {
  double sum = 0, count = 0;
  for (const Json* row : rows)
    if ((*row)[column].is_number()) {
      sum += (*row)[column].get<double>();
      ++count;
    }
  return count > 0 ? Json(sum / count) : Json();
}

Json summary(const Key& key, const std::vector<const Json*>& rows) {
  const Ratios errors(rows, "error");
  return {{"without", key[0]},
          {"set", key[1]},
          {"model", key[2]},
          {"logs", rows.size()},
          {"error", errors.geometric_mean()},
          {"worst", errors.worst()},
          {"best", errors.best()},
          {"share_with", mean(rows, "share_with")},
          {"share_without", mean(rows, "share_without")},
          {"silent_with", sum(rows, "silent_with")},
          {"silent_without", sum(rows, "silent_without")},
          {"mesh", Ratios(rows, "mesh").geometric_mean()},
          {"sigma_with", Ratios(rows, "error_over_sigma_with").geometric_mean()},
          {"sigma_without", Ratios(rows, "error_over_sigma_without").geometric_mean()},
          {"loops_with", sum(rows, "loops_with")},
          {"loops_without", sum(rows, "loops_without")},
          {"frame_time", Ratios(rows, "frame_time").geometric_mean()},
          {"finish_time", Ratios(rows, "finish_time").geometric_mean()}};
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
  std::map<Key, std::vector<const Json*>> rows;
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
