#include "stability_levels.hpp"

#include <array>
#include <cmath>
#include <map>
#include <random>

namespace gelslam::lab {
namespace {

using Names = std::vector<std::string>;

const Names kObjects = {"pebble", "peanut", "coin", "plank", "golf", "knurl"};
const Names kRoundObjects = {"pebble", "peanut", "golf", "knurl"};
constexpr std::array<const char*, 6> kAxes = {"x", "y", "z", "rx", "ry", "rz"};
constexpr int kStarts = 2;  // Initial poses that are tried for each pair of surfaces.
constexpr double kOrdinaryMm = 0.5, kOrdinaryDeg = 4.0;
constexpr double kDegreesPerMm = 10;  // In the chart "start", where both grow together.
constexpr double kRadiansPerDegree = M_PI / 180;

Pose displaced(const Pose& truth, const Eigen::Vector3d& by_mm, const Eigen::Vector3d& by_deg) {
  Pose gap = Pose::Identity();
  gap.linear() = so3_exp(by_deg * kRadiansPerDegree);
  gap.translation() = by_mm;
  return gap * truth;
}

/// Displacement of the initial pose, as a function of the number of the pair and that of the start.
using Displacement = std::function<Pose(const Pose& truth, std::size_t pair, int start)>;

Displacement somewhere(double mm, double deg) {
  return [=](const Pose& truth, std::size_t pair, int start) {
    std::mt19937_64 random(1000 * pair + static_cast<std::uint64_t>(start));
    std::normal_distribution<double> number;
    const auto direction = [&] {
      return Eigen::Vector3d(number(random), number(random), number(random)).normalized();
    };
    const Eigen::Vector3d along = direction(), about = direction();
    return displaced(truth, mm * along, deg * about);
  };
}

Displacement along_axis(std::size_t axis, double size) {
  return [=](const Pose& truth, std::size_t pair, int start) {
    const double sign = (pair + static_cast<std::size_t>(start)) % 2 == 0 ? 1 : -1;
    Eigen::Vector3d mm(0, 0, 0), deg(0, 0, 0);
    (axis < 3 ? mm : deg)[static_cast<int>(axis % 3)] = sign * size;
    return displaced(truth, mm, deg);
  };
}

class LevelMaker {
 public:
  LevelMaker(TouchStudio& studio, int places, const LevelSink& sink)
      : studio_(studio), places_(places), sink_(sink) {}

  template <class Set>
  std::vector<TouchPair> pairs(const Names& objects, const Set& set) {
    std::vector<TouchPair> made;
    for (const std::string& object : objects)
      for (int place = 0; place < places_; ++place) {
        TouchSpec spec;
        spec.object = object;
        spec.place = place;
        set(spec);
        made.push_back(studio_.make(spec));
      }
    return made;
  }

  void deliver(const std::string& chart, double level, const std::vector<TouchPair>& pairs,
               const Displacement& displacement) const {
    StabilityLevel out{chart, level, {}};
    for (std::size_t k = 0; k < pairs.size(); ++k) {
      out.set.references.push_back(pairs[k].reference);
      for (int start = 0; start < kStarts; ++start) {
        RegistrationProblem problem;
        problem.reference = k;
        problem.target = pairs[k].target;
        problem.truth = pairs[k].target_T_reference();
        problem.start = displacement(problem.truth, k, start);
        problem.start_number = start;
        out.set.problems.push_back(problem);
      }
    }
    sink_(out);
  }

  /// Adds one level per value; `set` writes the value into the specification of a touch.
  template <class Set>
  void chart(const std::string& name, const std::vector<double>& values, const Names& objects,
             const Set& set) {
    for (const double value : values)
      deliver(name, value, pairs(objects, [&](TouchSpec& spec) { set(spec, value); }),
              somewhere(kOrdinaryMm, kOrdinaryDeg));
  }

  void basins() {
    const std::vector<double> mm = {0.25, 0.5, 1, 1.5, 2, 3, 4, 5}, deg = {2.5, 5, 10, 15, 20, 30, 45, 60};
    // The same pairs for all of these charts.
    const std::vector<TouchPair> ordinary = pairs(kObjects, [](TouchSpec&) {});
    const auto basin = [&](const std::string& name, const std::vector<double>& sizes,
                           const auto& displacement) {
      for (const double size : sizes) deliver(name, size, ordinary, displacement(size));
    };
    for (std::size_t axis = 0; axis < kAxes.size(); ++axis)
      basin(std::string("start ") + kAxes[axis], axis < 3 ? mm : deg,
            [&](double size) { return along_axis(axis, size); });
    basin("start", mm, [](double size) { return somewhere(size, kDegreesPerMm * size); });
  }

 private:
  TouchStudio& studio_;
  const int places_;
  const LevelSink& sink_;
};

}  // namespace

bool is_basin(const std::string& chart) { return chart.starts_with("start"); }

void simulated_levels(TouchStudio& studio, int places, const LevelSink& sink) {
  LevelMaker maker(studio, places, sink);
  maker.basins();
  maker.chart("overlap", {1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1}, kObjects,
              [](TouchSpec& spec, double value) { spec.overlap = value; });
  maker.chart("noise", {0.5, 1, 2, 4, 8}, kObjects,
              [](TouchSpec& spec, double value) { spec.noise_gain = value; });
  maker.chart("texture", {1.5, 1.0, 0.7, 0.4, 0.2, 0.1, 0.05, 0.0}, kRoundObjects,
              [](TouchSpec& spec, double value) { spec.texture = value; });
  maker.chart("depth", {0.15, 0.25, 0.4, 0.7, 1.0, 1.5}, kObjects,
              [](TouchSpec& spec, double value) { spec.depth = value; });
  maker.chart("light drift", {0.0, 0.1, 0.2, 0.3, 0.4, 0.5}, kObjects,
              [](TouchSpec& spec, double value) { spec.light_change = value; });
  maker.chart("light jump", {0.0, 0.05, 0.1, 0.15, 0.2, 0.3}, kObjects, [](TouchSpec& spec, double value) {
    spec.light_change = value;
    spec.light_jumps = true;
  });
  maker.chart("dirt", {0, 30, 60, 120, 250, 500}, kObjects,
              [](TouchSpec& spec, double value) { spec.grains = static_cast<int>(value); });
}

void missing_frame_levels(const std::vector<std::filesystem::path>& folders, const LevelSink& sink) {
  ProblemChoice frames;
  frames.stride = 40;
  frames.gaps = {1, 2, 3, 4, 6, 8, 10, 12};
  frames.frames_missing = true;
  for (const std::filesystem::path& folder : folders) {
    const ProblemSet all = load_problems(folder, frames);
    std::map<int, StabilityLevel> by_gap;
    for (const RegistrationProblem& problem : all.problems) {
      StabilityLevel& level =
          by_gap
              .try_emplace(problem.gap,
                           StabilityLevel{"missing frames", static_cast<double>(problem.gap), {}})
              .first->second;
      level.set.references = all.references;
      level.set.problems.push_back(problem);
    }
    for (const auto& [gap, level] : by_gap) sink(level);
  }
}

}  // namespace gelslam::lab
