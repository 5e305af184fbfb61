#include <Eigen/Geometry>
#include <cmath>
#include <cstdint>
#include <nlohmann/json.hpp>
#include <string>

#include "gelslam/mesh/mesh_io.hpp"

namespace gelslam {
namespace {

using Json = nlohmann::ordered_json;

// Numbers that the glTF 2.0 specification gives its names.
constexpr int kVertexBuffer = 34962, kIndexBuffer = 34963, kUnsignedShort = 5123, kUnsignedInt = 5125,
              kFloat = 5126;
constexpr double kTouched = 0.75;  ///< gray of a surface without colors

/// The binary chunk and the JSON that describes it, column by column.
class GlbBuffer {
 public:
  template <typename Number>
  int add(const std::vector<Number>& numbers, std::size_t count, const char* type, int component, int target,
          Json more = Json::object()) {
    const std::size_t size = numbers.size() * sizeof(Number);
    views_.push_back(
        {{"buffer", 0}, {"byteOffset", bytes_.size()}, {"byteLength", size}, {"target", target}});
    bytes_.append(reinterpret_cast<const char*>(numbers.data()), size);
    Json accessor{
        {"bufferView", views_.size() - 1}, {"componentType", component}, {"count", count}, {"type", type}};
    accessor.update(more);
    accessors_.push_back(accessor);
    return static_cast<int>(accessors_.size()) - 1;
  }

  void describe(Json& gltf) const {
    gltf["accessors"] = accessors_;
    gltf["bufferViews"] = views_;
    gltf["buffers"] = Json::array({Json{{"byteLength", bytes_.size()}}});
  }
  const std::string& bytes() const { return bytes_; }

 private:
  std::string bytes_;
  Json views_ = Json::array(), accessors_ = Json::array();
};

int add_positions(GlbBuffer& buffer, const Mesh& mesh) {
  std::vector<float> positions_m;
  Eigen::AlignedBox3f box;
  for (const Eigen::Vector3f& vertex : mesh.vertices_mm) {
    const Eigen::Vector3f p = (vertex.cast<double>() * 1e-3).cast<float>();
    box.extend(p);
    positions_m.insert(positions_m.end(), p.begin(), p.end());
  }
  Json bounds;
  for (int i = 0; i < 3; ++i) {
    bounds["min"].push_back(box.min()[i]);
    bounds["max"].push_back(box.max()[i]);
  }
  return buffer.add(positions_m, mesh.vertices_mm.size(), "VEC3", kFloat, kVertexBuffer, bounds);
}

/// Has unit length, which glTF demands: a normal without direction becomes that of untouched gel.
int add_normals(GlbBuffer& buffer, const Mesh& mesh) {
  std::vector<float> normals;
  for (const Eigen::Vector3f& given : mesh.normals) {
    const Eigen::Vector3f n = given.norm() > 0 ? given.normalized() : Eigen::Vector3f(0, 0, -1);
    normals.insert(normals.end(), n.begin(), n.end());
  }
  return buffer.add(normals, mesh.normals.size(), "VEC3", kFloat, kVertexBuffer);
}

/// The linear intensity of an sRGB level (IEC 61966-2-1), as a 16-bit share.
std::uint16_t linear_share(std::uint8_t level) {
  const double s = level / 255.0;
  const double linear = s <= 0.04045 ? s / 12.92 : std::pow((s + 0.055) / 1.055, 2.4);
  return static_cast<std::uint16_t>(std::lround(65535 * linear));
}

int add_colors(GlbBuffer& buffer, const VertexColors& colors) {
  std::vector<std::uint16_t> rgba;
  for (const auto& color : colors) {
    for (const std::uint8_t level : color) rgba.push_back(linear_share(level));
    rgba.push_back(65535);
  }
  return buffer.add(rgba, colors.size(), "VEC4", kUnsignedShort, kVertexBuffer, {{"normalized", true}});
}

Json primitive(GlbBuffer& buffer, const Mesh& mesh, const VertexColors& colors) {
  Json attributes;
  attributes["POSITION"] = add_positions(buffer, mesh);
  if (!mesh.normals.empty()) attributes["NORMAL"] = add_normals(buffer, mesh);
  if (!colors.empty()) attributes["COLOR_0"] = add_colors(buffer, colors);
  if (!mesh.confidence.empty())
    attributes["_CONFIDENCE"] =
        buffer.add(mesh.confidence, mesh.confidence.size(), "SCALAR", kFloat, kVertexBuffer);
  std::vector<std::uint32_t> indices;
  for (const Eigen::Vector3i& t : mesh.triangles)
    for (const int corner : t) indices.push_back(static_cast<std::uint32_t>(corner));
  const int accessor = buffer.add(indices, indices.size(), "SCALAR", kUnsignedInt, kIndexBuffer);
  return {{"attributes", attributes}, {"indices", accessor}, {"material", 0}};
}

Json material(bool has_colors) {
  const double gray = has_colors ? 1.0 : kTouched;
  return {{"doubleSided", true},
          {"pbrMetallicRoughness",
           {{"baseColorFactor", Json::array({gray, gray, gray, 1.0})},
            {"metallicFactor", 0.0},
            {"roughnessFactor", 0.6}}}};
}

void append_number(std::string& out, std::size_t number) {
  for (int shift = 0; shift < 32; shift += 8) out += static_cast<char>(number >> shift & 0xFFU);
}

/// Length, kind and content, padded to four bytes.
void append_chunk(std::string& out, const char* kind, std::string content, char padding) {
  content.resize((content.size() + 3) / 4 * 4, padding);
  append_number(out, content.size());
  out.append(kind, 4);
  out += content;
}

}  // namespace

std::string encode_glb(const Mesh& mesh, const VertexColors& colors) {
  GlbBuffer buffer;
  Json gltf{{"asset", {{"version", "2.0"}, {"generator", "GelSLAM"}}}, {"scene", 0}};
  gltf["scenes"] = Json::array({Json{{"nodes", Json::array({0})}}});
  gltf["nodes"] =
      Json::array({Json{{"name", "surface"}, {"mesh", 0}, {"rotation", Json::array({1, 0, 0, 0})}}});
  gltf["meshes"] = Json::array({Json{{"primitives", Json::array({primitive(buffer, mesh, colors)})}}});
  gltf["materials"] = Json::array({material(!colors.empty())});
  buffer.describe(gltf);
  std::string chunks;
  append_chunk(chunks, "JSON", gltf.dump(), ' ');
  append_chunk(chunks, "BIN\0", buffer.bytes(), '\0');
  std::string glb = "glTF";
  append_number(glb, 2);
  append_number(glb, 12 + chunks.size());
  return glb + chunks;
}

}  // namespace gelslam
