#include <fmt/core.h>

#include <Eigen/Geometry>
#include <nlohmann/json.hpp>
#include <string>

#include "exchange_json.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/exchange/run_export.hpp"
#include "gelslam/image/color_map.hpp"
#include "page_template.hpp"

namespace gelslam {
namespace {

using exchange::detail::meters;
using PageJson = nlohmann::ordered_json;

std::string size_words(const Mesh& mesh) {
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) box.extend(vertex);
  const auto side = [&](int i) { return short_number(static_cast<double>(box.sizes()[i]), 3); };
  return fmt::format("{} × {} × {} mm", side(0), side(1), side(2));
}

std::string map_bytes_of(ColorMap map) {
  std::string bytes;
  for (const auto& rgb : color_map_rgb(map)) bytes.append(reinterpret_cast<const char*>(rgb.data()), 3);
  return base64(bytes);
}

PageJson places(const std::vector<Eigen::Vector3d>& points_mm) {
  PageJson numbers = PageJson::array();
  for (const Eigen::Vector3d& point_mm : points_mm)
    for (const double coordinate_mm : point_mm) numbers.push_back(meters(coordinate_mm));
  return numbers;
}

const char* color_name(MeshColor color) {
  static constexpr const char* kNames[] = {"plain", "confidence", "height"};
  return kNames[static_cast<int>(color)];
}

/// Everything the page's script shows, beside the mesh.
PageJson page_data(const RunContents& run, MeshColor color) {
  PageJson data{{"name", run.name}, {"color", color_name(color)}};
  data["figures"] = PageJson::array();
  for (const auto& [name, words] : run.figures) data["figures"].push_back({name, words});
  data["figures"].push_back({"Surface", size_words(run.mesh)});
  data["figures"].push_back({"Mesh", fmt::format("{} vertices, {} triangles", run.mesh.vertices_mm.size(),
                                                 run.mesh.triangles.size())});
  data["warnings"] = run.warnings;
  data["maps"] = {{"confidence", map_bytes_of(ColorMap::confidence)},
                  {"height", map_bytes_of(ColorMap::height)}};
  data["strips"] = PageJson::array();
  for (const auto& strip : exchange::detail::strips(run.trajectory)) data["strips"].push_back(places(strip));
  std::vector<Eigen::Vector3d> keyframes_mm;
  for (const StampedPose& pose : run.keyframes) keyframes_mm.push_back(pose.map_T_sensor.translation());
  data["keyframes"] = places(keyframes_mm);
  return data;
}

/// JSON that may stand in a script element: no "</script>", no "<!--".
std::string script_text(const PageJson& data) {
  std::string text;
  for (const char c : data.dump(-1, ' ', false, PageJson::error_handler_t::replace))
    c == '<' ? text += "\\u003c" : text += c;
  return text;
}

void fill_in(std::string& page, std::string_view mark, const std::string& text) {
  page.replace(page.find(mark), mark.size(), text);
}

}  // namespace

void write_page(const std::filesystem::path& path, const RunContents& run, MeshColor color) {
  if (run.mesh.triangles.empty()) throw Error(run.name + " has no mesh to show on a page");
  std::string page = kRunPage;
  fill_in(page, "{{RUN}}", script_text(page_data(run, color)));
  fill_in(page, "{{PLY}}", base64(encode_ply(run.mesh)));
  write_file_atomically(path, page);
}

}  // namespace gelslam
