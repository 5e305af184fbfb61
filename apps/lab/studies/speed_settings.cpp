#include <fmt/core.h>

#include <algorithm>

#include "baselines/baselines.hpp"
#include "speed_accuracy.hpp"

namespace gelslam::lab {
namespace {

constexpr int kAll = 1 << 30;

std::string text(double value) { return value >= kAll ? "all" : fmt::format("{:g}", value); }

/// Varies one option of a method over some values; the default value is left out.
template <class Options, class Make>
class Knobs {
 public:
  Knobs(std::vector<SpeedSetting>& settings, std::string method, Make make, const Options& defaults)
      : settings_(settings), method_(std::move(method)), make_(make), defaults_(defaults) {
    settings_.push_back({method_, "default", "", make_(defaults_)});
  }

  template <class Field>
  void turn(const std::string& knob, Field Options::*field, const std::vector<Field>& values) {
    for (const Field& value : values) {
      Options options = defaults_;
      if (options.*field == value) continue;
      options.*field = value;
      settings_.push_back({method_, knob, text(static_cast<double>(value)), make_(options)});
    }
  }
  void add(const std::string& knob, const std::string& value, const Options& options) {
    settings_.push_back({method_, knob, value, make_(options)});
  }

 private:
  std::vector<SpeedSetting>& settings_;
  std::string method_;
  Make make_;
  Options defaults_;
};

void normal_flow_settings(std::vector<SpeedSetting>& settings) {
  using Options = NormalFlowOptions;
  Knobs knobs(
      settings, "normalflow", [](const Options& o) { return make_normal_flow(o); }, Options{});
  knobs.turn<int>("samples", &Options::max_samples,
                  {50, 100, 200, 500, 1000, 1500, 2000, 3000, 5000, 10000, kAll});
  for (const int iterations : {1, 2, 3, 4, 5, 6, 8, 12}) {
    Options options;
    options.max_iterations = iterations;
    options.min_iterations = std::min(options.min_iterations, iterations);
    knobs.add("iterations", text(iterations), options);
  }
  knobs.turn<int>("least iterations", &Options::min_iterations, {1, 2, 3, 4, 6});
  knobs.turn<double>("robust scale", &Options::robust_scale_rad, {0.02, 0.03, 0.05, 0.1, 0.2, 0.5, 10.0});
}

void icp_settings(std::vector<SpeedSetting>& settings) {
  using Options = IcpOptions;
  Knobs knobs(
      settings, "icp", [](const Options& o) { return make_icp(o); }, Options{});
  knobs.turn<int>("points", &Options::max_points, {250, 500, 1000, 2000, 5000, 10000, kAll});
  knobs.turn<double>("distance mm", &Options::max_distance_mm, {0.1, 0.2, 0.5, 1.0, 100.0});
  knobs.turn<int>("iterations", &Options::max_iterations, {3, 10, 30, 100});
  knobs.add("tuned", "", tuned_icp());
}

void fpfh_settings(std::vector<SpeedSetting>& settings) {
  using Options = FpfhOptions;
  Knobs knobs(
      settings, "fpfh", [](const Options& o) { return make_fpfh(o); }, Options{});
  knobs.turn<int>("points", &Options::max_points, {1000, 5000});
  knobs.turn<int>("ransac iterations", &Options::ransac_iterations, {1000, 10000});
  knobs.turn<double>("feature radius mm", &Options::feature_radius_mm, {0.5, 1.0});
  knobs.turn<double>("ransac distance mm", &Options::max_distance_mm, {0.2, 0.4, 1.0});
  knobs.add("tuned", "", tuned_fpfh());
}

void filter_reg_settings(std::vector<SpeedSetting>& settings) {
  using Options = FilterRegOptions;
  Knobs knobs(
      settings, "filterreg", [](const Options& o) { return make_filter_reg(o); }, Options{});
  knobs.turn<int>("points", &Options::max_points, {250, 500, 1000, 2000, 5000, 10000, kAll});
  knobs.turn<double>("variance mm2", &Options::variance_mm2, {0.0025, 0.005, 0.01, 0.02, 0.04, 0.09});
  knobs.turn<double>("tolerance mm2", &Options::tolerance_mm2, {1e-4, 1e-5, 1e-6, 1e-7, 1e-8, 1e-9});
  knobs.turn<double>("outliers", &Options::outlier_share, {0.0, 0.1, 0.3});
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
