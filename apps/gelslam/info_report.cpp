#include "info_report.hpp"

#include <algorithm>

#include "gelslam/core/text.hpp"

namespace gelslam {

using Json = nlohmann::ordered_json;

InfoReport::InfoReport(const std::filesystem::path& path, const std::string& kind)
    : path_(path.string()), kind_(kind) {}

void InfoReport::add(const std::string& key, Json value, const std::string& words) {
  facts_.push_back({key, std::move(value), words});
}

void InfoReport::add_problem(const std::string& words) { problems_.push_back(one_line(words)); }

std::string InfoReport::text() const {
  std::size_t widest = std::string("problem").size();
  for (const Fact& fact : facts_) widest = std::max(widest, fact.key.size());
  std::string text = one_line(path_) + ": " + kind_ + "\n";
  const auto line = [&](const std::string& key, const std::string& words) {
    text += "  " + key + std::string(widest + 2 - key.size(), ' ') + one_line(words) + "\n";
  };
  for (const Fact& fact : facts_) line(fact.key, fact.words);
  for (const std::string& problem : problems_) line("problem", problem);
  return text;
}

std::string InfoReport::json() const {
  Json object{{"path", path_}, {"kind", kind_}};
  for (const Fact& fact : facts_) object[fact.key] = fact.value;
  object["problems"] = problems_;
  // File names may be of any bytes; what is not UTF-8 is replaced instead of refused.
  return object.dump(2, ' ', false, Json::error_handler_t::replace) + "\n";
}

}  // namespace gelslam
