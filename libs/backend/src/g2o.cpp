#include "gelslam/backend/g2o.hpp"

#include <iomanip>
#include <limits>
#include <sstream>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/index.hpp"

namespace gelslam {
namespace {

void write_pose(std::ostream& out, const Pose& pose) {
  const Eigen::Vector3d t = 1e-3 * pose.translation();
  const Eigen::Quaterniond q = Eigen::Quaterniond(pose.linear()).normalized();
  for (const double value : {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}) out << ' ' << value;
}

// The program's information matrix is over (rotation vector in rad, translation in mm). That of g2o is over
// (translation in m, half the rotation vector).
Matrix6d g2o_information(const Matrix6d& information) {
  Matrix6d ours_of_g2o = Matrix6d::Zero();
  ours_of_g2o.topRightCorner<3, 3>() = 2.0 * Eigen::Matrix3d::Identity();
  ours_of_g2o.bottomLeftCorner<3, 3>() = 1e3 * Eigen::Matrix3d::Identity();
  return ours_of_g2o.transpose() * information * ours_of_g2o;
}

void write_gauge(std::ostream& out, const std::map<int, Pose>& map_T_node,
                 const std::vector<PoseGraphEdge>& edges) {
  std::map<int, int> index_of;
  for (const auto& [id, pose] : map_T_node) index_of.emplace(id, static_cast<int>(index_of.size()));
  UnionFind components(static_cast<int>(index_of.size()));
  for (const PoseGraphEdge& edge : edges) components.join(index_of.at(edge.from), index_of.at(edge.to));
  for (const auto& [id, index] : index_of)
    if (components.root(index) == index) out << "FIX " << id << '\n';
}

void write_edges(std::ostream& out, const std::vector<PoseGraphEdge>& edges) {
  out << std::setprecision(std::numeric_limits<double>::max_digits10);
  for (const PoseGraphEdge& edge : edges) {
    out << "EDGE_SE3:QUAT " << edge.from << ' ' << edge.to;
    write_pose(out, edge.from_T_to);
    const Matrix6d information = g2o_information(edge.information);
    for (int row = 0; row < 6; ++row)
      for (int column = row; column < 6; ++column) out << ' ' << information(row, column);
    out << '\n';
  }
}

}  // namespace

void write_g2o(const std::filesystem::path& path, const std::map<int, Pose>& map_T_node,
               const std::vector<PoseGraphEdge>& edges) {
  for (const PoseGraphEdge& edge : edges)
    for (const int id : {edge.from, edge.to})
      if (!map_T_node.contains(id))
        throw Error("g2o: an edge names node " + std::to_string(id) + ", which has no pose");

  std::ostringstream out;
  out << std::setprecision(std::numeric_limits<double>::max_digits10);
  for (const auto& [id, pose] : map_T_node) {
    out << "VERTEX_SE3:QUAT " << id;
    write_pose(out, pose);
    out << '\n';
  }
  write_gauge(out, map_T_node, edges);
  write_edges(out, edges);
  write_file_atomically(path, out.str());
}

void write_g2o_edges(const std::filesystem::path& path, const std::vector<PoseGraphEdge>& edges) {
  std::ostringstream out;
  write_edges(out, edges);
  write_file_atomically(path, out.str());
}

}  // namespace gelslam
