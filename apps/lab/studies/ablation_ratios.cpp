#include <algorithm>
#include <cmath>
#include <map>

#include "ablation_case.hpp"

namespace gelslam::lab {
namespace {

using Key = std::vector<std::string>;

Key key_of(const Json& row) { return {row["set"], row["sequence"], row["model"]}; }

/// Null if one of both is missing.
Json ratio(const Json& without, const Json& with) {
  constexpr double kMin = 1e-9;
  if (!without.is_number() || !with.is_number()) return nullptr;
  const double ratio = std::max(without.get<double>(), kMin) / std::max(with.get<double>(), kMin);
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

}  // namespace gelslam::lab
