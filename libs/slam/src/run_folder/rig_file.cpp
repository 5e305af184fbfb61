#include <array>

#include "gelslam/core/error.hpp"
#include "gelslam/core/options.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/core/run_report.hpp"
#include "gelslam/slam/sensor_rig.hpp"
#include "run_folder/session_text.hpp"

namespace gelslam {
namespace {

/// As the report of a run folder states it. Nothing where it states none.
std::optional<RigPose> rig_of_run(const std::filesystem::path& run) {
  check_run_files(run);
  const std::optional<RunReport> report = find_report(run);
  if (!report || !report->rig) return std::nullopt;
  const RunReport::Rig& rig = *report->rig;
  Vector6d sigma;
  sigma << Eigen::Vector3d::Map(rig.sigma_deg.data()) / kDegreesPerRadian,
      Eigen::Vector3d::Map(rig.sigma_mm.data());
  return RigPose{slam::detail::pose_from(rig.first_T_second_mm), sigma.cwiseAbs2().asDiagonal()};
}

}  // namespace

RigPose read_rig(const std::filesystem::path& file) {
  if (std::filesystem::is_directory(file)) {
    if (const auto found = rig_of_run(file)) return *found;
    throw Error(file.string() + ": does not tell how two sensors are fixed to each other; give --rig FILE");
  }
  constexpr double kMaxMm = 1000;
  constexpr std::array<const char*, 3> kAxes = {"x", "y", "z"};
  Pose first_T_second = Pose::Identity();
  double sigma_mm = 1.0, sigma_deg = 2.0;
  read_options(file, [&](OptionVisitor& visit) {
    for (int column = 0; column < 3; ++column)
      visit.section(std::string("second_") + kAxes[static_cast<std::size_t>(column)],
                    "this axis of the second sensor, in the first one's frame", [&] {
                      for (int row = 0; row < 3; ++row)
                        visit.number(kAxes[static_cast<std::size_t>(row)], first_T_second(row, column), -1, 1,
                                     "");
                    });
    visit.section("second_origin", "of the second sensor, in the first one's frame", [&] {
      for (int row = 0; row < 3; ++row)
        visit.number(kAxes[static_cast<std::size_t>(row)], first_T_second(row, 3), -kMaxMm, kMaxMm, "mm");
    });
    visit.number("sigma_mm", sigma_mm, 1e-3, kMaxMm, "standard deviation of the origin, per axis");
    visit.number("sigma_deg", sigma_deg, 1e-2, 180, "standard deviation of the rotation, per axis");
  });
  const Eigen::Matrix3d rotation = first_T_second.linear();
  if (rotation.determinant() < 0)
    throw Error(file.string() + ": the second sensor's axes are a reflection of the first one's");
  constexpr double kTolerance = 1e-2;  // three decimals
  if (!rotation.isUnitary(kTolerance))
    throw Error(file.string() + ": the second sensor's axes are not of length 1 and at right angles");
  Vector6d sigma;
  sigma << Eigen::Vector3d::Constant(sigma_deg / kDegreesPerRadian), Eigen::Vector3d::Constant(sigma_mm);
  return {normalized(first_T_second), sigma.cwiseAbs2().asDiagonal()};
}

std::optional<RigPose> read_given_rig(const std::filesystem::path& file) {
  return file.empty() ? std::nullopt : std::optional(read_rig(file));
}

}  // namespace gelslam
