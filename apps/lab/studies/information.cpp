// Study: is the information of a registration honest, and is what it calls tracked right? Pairs of frames of
// sequences with truth, a few frames apart, are registered from the true pose of the frame before. Printed
// per sequence:
//   wrong        called tracked, yet more than 1 mm or 5 degrees off along an axis called observable
//   median, p90  of the errors weighed by their information, over those of the chi-square distribution with
//   as
//                many degrees of freedom as directions are observable: 1 is honest, above 1 is too sure
//   x .. rz      root mean square error along an axis over its own sigma, about the shared contact's center,
//   where
//                the axis is observable
// --csv writes every pair.

#include <fmt/core.h>

#include <array>
#include <cmath>
#include <filesystem>
#include <iostream>
#include <string>
#include <vector>

#include "gelslam/core/files.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/registration/normal_flow.hpp"
#include "judgement.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

namespace fs = std::filesystem;

// A sigma beyond these is no knowledge: the direction is not observable.
constexpr double kUnknownRad = 0.2, kUnknownMm = 1.0;
// Median and 90 % of chi-square for 1 to 6 degrees of freedom.
constexpr std::array<double, 6> kChiMedian = {0.455, 1.386, 2.366, 3.357, 4.351, 5.348};
constexpr std::array<double, 6> kChi90 = {2.706, 4.605, 6.251, 7.779, 9.236, 10.645};
// x y z rx ry rz, as people read them, in the order of information matrices.
constexpr std::array<int, 6> kColumns = {3, 4, 5, 0, 1, 2};

struct InformationArguments {
  std::vector<fs::path> data;
  ProblemChoice choice{30, {1, 5, 12, 25}};
  fs::path csv;
};

/// One pair, about the center of the shared contact, in the reference's axes.
struct Outcome {
  bool tracked = false, wrong = false;
  Vector6d error = Vector6d::Zero();  ///< true = estimate * exp(error)
  Vector6d sigma = Vector6d::Zero();
  double chi_square = 0.0;
  int observable = 0;  ///< directions
};

Outcome judge(const RegistrationResult& result, const RegistrationProblem& problem) {
  Outcome outcome;
  outcome.tracked = result.ok();
  if (!result.ok()) return outcome;
  outcome.wrong = judge_result(problem, result).wrong;
  const Pose at_center = Pose(Eigen::Translation3d(result.shared_center_mm));
  const Matrix6d origin_from_center = adjoint(at_center);
  const Matrix6d information = origin_from_center.transpose() * result.information * origin_from_center;
  outcome.error =
      se3_log(at_center.inverse() * result.target_T_reference.inverse() * problem.truth * at_center);
  Vector6d unknown;
  unknown << kUnknownRad, kUnknownRad, kUnknownRad, kUnknownMm, kUnknownMm, kUnknownMm;
  const Matrix6d scaled = unknown.asDiagonal() * information * unknown.asDiagonal();
  const SymmetricEigen eigen = symmetric_eigen(scaled);
  outcome.observable = static_cast<int>((eigen.values.array() > 1.0).count());
  const Vector6d along = eigen.vectors.transpose() * outcome.error.cwiseQuotient(unknown);
  for (int i = 6 - outcome.observable; i < 6; ++i)
    outcome.chi_square += eigen.values[i] * along[i] * along[i];
  const Matrix6d covariance = (scaled + 1e-9 * Matrix6d::Identity()).inverse();
  outcome.sigma = unknown.cwiseProduct(covariance.diagonal().cwiseSqrt());
  return outcome;
}

std::string row(const std::string& name, const std::vector<Outcome>& outcomes) {
  std::vector<double> by_median, by_90;
  std::array<double, 6> sum2{};
  std::array<int, 6> count{};
  int tracked = 0, wrong = 0;
  for (const Outcome& outcome : outcomes) {
    tracked += outcome.tracked ? 1 : 0;
    wrong += outcome.wrong ? 1 : 0;
    if (outcome.observable == 0) continue;
    by_median.push_back(outcome.chi_square / kChiMedian[static_cast<std::size_t>(outcome.observable - 1)]);
    by_90.push_back(outcome.chi_square / kChi90[static_cast<std::size_t>(outcome.observable - 1)]);
    for (std::size_t i = 0; i < 6; ++i) {
      const int axis = kColumns[i];
      if (outcome.sigma[axis] > (axis < 3 ? kUnknownRad : kUnknownMm)) continue;
      sum2[i] += std::pow(outcome.error[axis] / outcome.sigma[axis], 2);
      ++count[i];
    }
  }
  std::string text = fmt::format("{:<20} {:5} {:7} {:5} {:7.2f} {:6.2f} ", name, outcomes.size(), tracked,
                                 wrong, quantile(by_median, 0.5), quantile(by_90, 0.9));
  for (std::size_t i = 0; i < 6; ++i)
    text += count[i] == 0 ? "     -" : fmt::format(" {:5.2f}", std::sqrt(sum2[i] / count[i]));
  return text;
}

std::string csv_lines(const std::string& name, const std::vector<Outcome>& outcomes) {
  std::string text;
  for (const Outcome& o : outcomes) {
    text += fmt::format("{},{},{},{},{:.6g}", name, o.tracked, o.wrong, o.observable, o.chi_square);
    for (const Vector6d& numbers : {o.error, o.sigma})
      for (const int axis : kColumns) text += fmt::format(",{:.6g}", numbers[axis]);
    text += "\n";
  }
  return text;
}

void run(const InformationArguments& arguments) {
  std::string csv =
      "sequence,tracked,wrong,observable,chi_square,ex_mm,ey_mm,ez_mm,erx_rad,ery_rad,erz_rad,sx_mm,sy_mm,sz_"
      "mm,"
      "srx_rad,"
      "sry_rad,srz_rad\n";
  fmt::print("{:<20} {:>5} {:>7} {:>5} {:>7} {:>6}  {:>5} {:>5} {:>5} {:>5} {:>5} {:>5}\n", "sequence",
             "pairs", "tracked", "wrong", "median", "p90", "x", "y", "z", "rx", "ry", "rz");
  std::vector<Outcome> all;
  const NormalFlowOptions options;
  StudyCases cases(arguments.data.size());
  for (const fs::path& folder : arguments.data) {
    const std::string name = name_of(folder);
    cases.begin(name);
    const ProblemSet set = load_problems(folder, {320, 240}, arguments.choice);
    std::vector<NormalFlowReference> references;
    for (const SurfacePtr& surface : set.references) references.emplace_back(surface, options);
    std::vector<Outcome> outcomes;
    for (const RegistrationProblem& problem : set.problems)
      outcomes.push_back(
          judge(register_normal_flow(references[problem.reference], *problem.target, problem.start, options),
                problem));
    std::cout << row(name, outcomes) << std::endl;
    csv += csv_lines(name, outcomes);
    all.insert(all.end(), outcomes.begin(), outcomes.end());
  }
  std::cout << row("all", all) << std::endl;
  if (!arguments.csv.empty()) write_file_atomically(arguments.csv, csv);
}

}  // namespace

void add_information(CLI::App& lab) {
  const auto arguments = std::make_shared<InformationArguments>();
  CLI::App* command = add_study(
      lab, "information", "Compare errors of registrations with the sigmas they report", arguments, run);
  command->add_option("DATA", arguments->data, "Data folders with true_start_T_currs.npy")->required();
  command->add_option("--stride", arguments->choice.stride, "Frames between references")
      ->check(CLI::PositiveNumber);
  command->add_option("--gaps", arguments->choice.gaps, "Frames between reference and target")
      ->check(CLI::PositiveNumber);
  command->add_option("--csv", arguments->csv, "Write every pair to this file");
  command->footer("Example: gelslam-lab information DATA/sequences/track_coin --csv pairs.csv");
}

}  // namespace gelslam::lab
