#include <sstream>

#include "ablation_case.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam::lab {
namespace {

/// Replaces a value in `yaml`, which must be as written by write_config(): one line per key, sections without
/// a value.
std::string replaced(const std::string& yaml, const std::string& key, const std::string& value,
                     const std::string& variant) {
  const auto dot = key.find('.');
  const std::string wanted_section = dot == std::string::npos ? "" : key.substr(0, dot);
  const std::string wanted_key = dot == std::string::npos ? key : key.substr(dot + 1);
  std::istringstream lines(yaml);
  std::string result, section;
  int found = 0;
  for (std::string line; std::getline(lines, line);) {
    const auto indent = line.find_first_not_of(' '), colon = line.find(':');
    const bool is_key = indent != std::string::npos && line[indent] != '#' && colon != std::string::npos;
    const std::string name = is_key ? line.substr(indent, colon - indent) : "";
    const std::string rest = is_key ? trimmed(line.substr(colon + 1)) : "";
    if (is_key && (rest.empty() || rest.front() == '#')) {
      section = name;
    } else if (is_key && name == wanted_key && (wanted_section.empty() || wanted_section == section)) {
      line = line.substr(0, colon + 1) + " " + value;
      ++found;
    }
    result += line + "\n";
  }
  if (found == 0) throw Error(variant + ": the configuration has no key " + key);
  if (found > 1) throw Error(variant + ": several sections have a key " + key + "; write section.key");
  return result;
}

}  // namespace

std::vector<Variant> mechanism_variants() {
  return {{"gradient scale", {{"estimate_gradient_scale", "false"}}},
          {"keyframes at turning points", {{"keyframe_min_unseen", "1"}}},
          {"early keyframes", {{"keyframe_min_shared", "0"}}},
          {"light compensation", {{"compensate_light", "false"}}},
          {"relocalization", {{"relocalize", "false"}}},
          {"overlap edges", {{"refine_pairs_per_keyframe", "0"}}},
          {"patience", {{"patience_s", "0"}}},
          // This has no effect for models that contain their optics.
          {"lens", {{"lens_k1", "0"}, {"lens_center_px", "[0, 0]"}, {"pixel_aspect", "1"}}},
          {"perspective", {{"camera_distance_mm", "0"}}},
          {"dome", {{"gel_dome_per_mm", "[0, 0]"}}}};
}

Variant parse_variant(const std::string& text) {
  const auto colon = text.find(':');
  Variant variant{trimmed(text.substr(0, colon)), {}};
  std::istringstream settings(colon == std::string::npos ? "" : text.substr(colon + 1));
  for (std::string setting, more; std::getline(settings, setting, ',');) {
    while (setting.find('[') != std::string::npos && setting.find(']') == std::string::npos &&
           std::getline(settings, more, ','))  // Commas within a list.
      setting += "," + more;
    const auto equals = setting.find('=');
    if (equals == std::string::npos) break;
    variant.settings.emplace_back(trimmed(setting.substr(0, equals)), trimmed(setting.substr(equals + 1)));
  }
  if (variant.name.empty() || variant.settings.empty())
    throw Error("--set expects \"name: key=value, key=value\", not \"" + text + "\"");
  return variant;
}

Config with_settings(const Config& config, const Variant& variant) {
  std::string yaml = write_config(config);
  for (const auto& [key, value] : variant.settings) yaml = replaced(yaml, key, value, variant.name);
  return read_config_text(yaml, variant.name);
}

}  // namespace gelslam::lab
