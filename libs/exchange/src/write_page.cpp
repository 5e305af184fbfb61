#include <fmt/core.h>

#include <nlohmann/json.hpp>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/exchange/run_export.hpp"
#include "page_template.hpp"

namespace gelslam {
namespace {

using PageJson = nlohmann::ordered_json;

PageJson places(const std::vector<Pose>& poses) {
  PageJson numbers = PageJson::array();
  for (const Pose& pose : poses)
    for (const double coordinate_mm : pose.translation()) numbers.push_back(meters(coordinate_mm));
  return numbers;
}

const char* color_name(MeshColor color) {
  static constexpr const char* kNames[] = {"plain", "confidence", "height"};
  return kNames[static_cast<int>(color)];
}

/// Returns all data that the page's script shows, except the mesh.
PageJson page_data(const RunContents& run, MeshColor color) {
  PageJson data{{"name", run.name}, {"color", color_name(color)}};
  data["figures"] = PageJson::array();
  for (const auto& [name, words] : run.figures) data["figures"].push_back({name, words});
  data["figures"].push_back({"Mesh", fmt::format("{} vertices, {} triangles", run.mesh.vertices_mm.size(),
                                                 run.mesh.triangles.size())});
  data["warnings"] = run.warnings;
  data["strips"] = PageJson::array();
  for (const auto& segment : unbroken_segments(run.trajectory)) data["strips"].push_back(places(segment));
  std::vector<Pose> keyframes;
  for (const StampedPose& pose : run.keyframes) keyframes.push_back(pose.map_T_sensor);
  data["keyframes"] = places(keyframes);
  return data;
}

/// Returns JSON that can be put into a script element, without "</script>" and "<!--".
std::string script_text(const PageJson& data) {
  std::string text;
  for (const char c : data.dump(-1, ' ', false, PageJson::error_handler_t::replace))
    c == '<' ? text += "\\u003c" : text += c;
  return text;
}

}  // namespace

void write_page(const std::filesystem::path& path, const RunContents& run, MeshColor color) {
  if (run.mesh.triangles.empty()) throw Error(run.name + " has no mesh to show on a page");
  const std::string_view frame = kRunPage, place = "<!--data-->";
  const std::size_t at = frame.find(place);
  write_file_atomically(path,
                        fmt::format("{}<script type=\"application/json\" id=\"run\">{}</script>\n"
                                    "<script type=\"text/plain\" id=\"mesh\">{}</script>{}",
                                    frame.substr(0, at), script_text(page_data(run, color)),
                                    base64(encode_mesh(run.mesh, ".ply")), frame.substr(at + place.size())));
}

}  // namespace gelslam
