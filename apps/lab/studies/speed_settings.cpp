#include <fmt/core.h>

#include <algorithm>

#include "baselines/baselines.hpp"
#include "speed_accuracy.hpp"

namespace gelslam::lab {
namespace {

constexpr int kAll = 1 << 30;

std::string text(double value) { return value >= kAll ? "all" : fmt::format("{:g}", value); }

/// Turns one knob of a method's options through some values; what is the default is left out.
template <class Options, class Make>
class Knobs {
 public:
  Knobs(std::vector<SpeedSetting>& settings, std::string method, Make make, const Options& defaults = {})
      : settings_(settings), method_(std::move(method)), make_(make), defaults_(defaults) {
    settings_.push_back({method_, "default", "", {320, 240}, make_(defaults_)});
  }

  template <class Field>
  void turn(const std::string& knob, Field& (*field)(Options&), const std::vector<Field>& values) {
    for (const Field& value : values) {
      Options options = defaults_;
      if (field(options) == value) continue;
      field(options) = value;
      settings_.push_back({method_, knob, text(static_cast<double>(value)), {320, 240}, make_(options)});
    }
  }
  void add(const std::string& knob, const std::string& value, const Options& options,
           cv::Size size = {320, 240}) {
    settings_.push_back({method_, knob, value, size, make_(options)});
  }

 private:
  std::vector<SpeedSetting>& settings_;
  std::string method_;
  Make make_;
  Options defaults_;
};

void normal_flow_settings(std::vector<SpeedSetting>& settings) {
  using Options = NormalFlowOptions;
  Knobs<Options, decltype(&make_normal_flow)> knobs(settings, "normalflow", &make_normal_flow);
  knobs.turn<int>("samples", [](Options& o) -> int& { return o.max_samples; },
                  {50, 100, 200, 500, 1000, 1500, 2000, 3000, 5000, 10000, kAll});
  for (const int iterations : {1, 2, 3, 4, 5, 6, 8, 12}) {
    Options options;
    options.max_iterations = iterations;
    options.min_iterations = std::min(options.min_iterations, iterations);
    knobs.add("iterations", text(iterations), options);
  }
  knobs.turn<int>("least iterations", [](Options& o) -> int& { return o.min_iterations; }, {1, 2, 3, 4, 6});
  knobs.turn<double>("robust scale", [](Options& o) -> double& { return o.robust_scale_rad; },
                     {0.02, 0.03, 0.05, 0.1, 0.2, 0.5, 10.0});
  for (const cv::Size size : {cv::Size{80, 60}, {160, 120}, {240, 180}, {480, 360}, {640, 480}})
    knobs.add("resolution", std::to_string(size.width) + "x" + std::to_string(size.height), {}, size);
}

void icp_settings(std::vector<SpeedSetting>& settings) {
  using Options = IcpOptions;
  Knobs<Options, decltype(&make_icp)> knobs(settings, "icp", &make_icp);
  knobs.turn<int>("points", [](Options& o) -> int& { return o.max_points; },
                  {250, 500, 1000, 2000, 5000, 10000, kAll});
  knobs.turn<double>("distance mm", [](Options& o) -> double& { return o.max_distance_mm; },
                     {0.1, 0.2, 0.5, 1.0, 100.0});
  knobs.turn<int>("iterations", [](Options& o) -> int& { return o.max_iterations; }, {3, 10, 30, 100});
  for (const int points : {2000, kAll}) {
    Options options;
    options.max_points = points;
    options.max_distance_mm = 0.2;
    knobs.add("points; distance 0.2 mm", text(points), options);
  }
  knobs.add("tuned", "", tuned_icp());
}

void fpfh_settings(std::vector<SpeedSetting>& settings) {
  using Options = FpfhOptions;
  Knobs<Options, decltype(&make_fpfh)> knobs(settings, "fpfh", &make_fpfh);
  knobs.turn<int>("points", [](Options& o) -> int& { return o.max_points; }, {1000, 5000});
  knobs.turn<int>("ransac iterations", [](Options& o) -> int& { return o.ransac_iterations; }, {1000, 10000});
  knobs.turn<double>("feature radius mm", [](Options& o) -> double& { return o.feature_radius_mm; },
                     {0.5, 1.0});
  knobs.turn<double>("ransac distance mm", [](Options& o) -> double& { return o.max_distance_mm; },
                     {0.2, 0.4, 1.0});
  knobs.add("tuned", "", tuned_fpfh());
}

void filter_reg_settings(std::vector<SpeedSetting>& settings) {
  using Options = FilterRegOptions;
  Knobs<Options, decltype(&make_filter_reg)> knobs(settings, "filterreg", &make_filter_reg);
  knobs.turn<int>("points", [](Options& o) -> int& { return o.max_points; },
                  {250, 500, 1000, 2000, 5000, 10000, kAll});
  knobs.turn<double>("variance mm2", [](Options& o) -> double& { return o.variance_mm2; },
                     {0.0025, 0.005, 0.01, 0.02, 0.04, 0.09});
  knobs.turn<double>("tolerance mm2", [](Options& o) -> double& { return o.tolerance_mm2; },
                     {1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9});
  knobs.turn<double>("outliers", [](Options& o) -> double& { return o.outlier_share; }, {0.0, 0.1, 0.3});
  for (const double variance_mm2 : {0.0025, 0.01}) {
    Options options;
    options.variance_mm2 = variance_mm2;
    options.outlier_share = 0.3;
    knobs.add("variance mm2; outliers 0.3", text(variance_mm2), options);
  }
  knobs.add("tuned", "", tuned_filter_reg());
}

}  // namespace

std::vector<SpeedSetting> speed_settings(const std::vector<std::string>& methods) {
  std::vector<SpeedSetting> settings;
  const auto wanted = [&](const char* method) {
    return std::find(methods.begin(), methods.end(), method) != methods.end();
  };
  if (wanted("normalflow")) normal_flow_settings(settings);
  if (wanted("icp")) icp_settings(settings);
  if (wanted("filterreg")) filter_reg_settings(settings);
  if (wanted("fpfh")) fpfh_settings(settings);
  return settings;
}

}  // namespace gelslam::lab
