// Motions of an object over the simulated sensor. A motion gives for each frame how the object is held
// (Grip). The pose follows from it: bodies are shifted so that they rest on their lowest points near the
// sensor's center, and the height is such that the lowest point over the view has the wanted indentation.
// Shifts and heights are smoothed over time.

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>
#include <utility>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/simulation/simulator.hpp"
#include "random.hpp"

namespace gelslam {
namespace {

using simulation::detail::hash;
using simulation::detail::Random;

constexpr double kPi = std::numbers::pi;
constexpr double kLiftedMm = -1.5;  // A negative indentation is clear of the gel.
constexpr double kPressInFrames = 8;
constexpr double kLateralSmoothingFrames = 6, kSupportSmoothingFrames = 2;
constexpr double kSupportSoftnessMm =
    0.5;  // The object rests on the parts whose height is within about this of its lowest point.
constexpr double kViewMarginMm = 0.3;

constexpr double radians(double degrees) { return degrees * kPi / 180; }

/// A smooth random function of time that is 0 at time 0, with an amplitude of about 1: a sum of a few slow
/// sine waves.
class SmoothRandom {
 public:
  explicit SmoothRandom(std::uint64_t seed) {
    Random random(seed);
    for (std::size_t k = 0; k < waves_.size(); ++k)
      waves_[k] = {random.uniform(0.06, 0.16) * static_cast<double>(k + 1), random.uniform(0, 2 * kPi),
                   0.6 / static_cast<double>(k + 1)};
  }
  double operator()(double time_s) const {
    double sum = 0;
    for (const Wave& w : waves_)
      sum += w.amplitude * (std::sin(2 * kPi * w.hz * time_s + w.phase) - std::sin(w.phase));
    return sum;
  }

 private:
  struct Wave {
    double hz = 0, phase = 0, amplitude = 0;
  };
  std::array<Wave, 3> waves_{};
};

/// How the object is held in one frame.
struct Grip {
  double roll = 0, pitch = 0, twist = 0;  ///< about the sensor's x, y, z, radians
  /// Shift of the contact (for flat objects, of the object) on the sensor.
  Eigen::Vector2d shift_mm = Eigen::Vector2d::Zero();
  double indentation_mm = 0;
};

/// Freedom of a kind of object: factors on roll (about x), pitch (about y) and shift.
struct Freedom {
  double roll, pitch, shift;
};
Freedom freedom_of(ShapeKind kind) {
  if (kind == ShapeKind::body) return {1, 1, 1};
  if (kind == ShapeKind::rod) return {1, 0.06, 1};
  return {0.06, 0.06, 1.6};
}

/// Everything from which a motion computes how the object is held at frame k.
struct Clock {
  const MotionSpec& spec;
  Freedom freedom;
  Eigen::Vector2d half_size_mm;  ///< of the object, across its x and y
  ShapeKind kind;
  std::array<SmoothRandom, 6> random;

  double time_s(int k) const { return k / spec.frame_rate_hz; }
  double progress(int k) const { return spec.frames > 1 ? static_cast<double>(k) / (spec.frames - 1) : 0; }
  /// Returns the unsteadiness of the hand.
  Grip hand(int k, double amount) const {
    const double t = time_s(k), a = amount * spec.speed;
    Grip grip;
    grip.roll = a * freedom.roll * radians(13) * random[0](t);
    grip.pitch = a * freedom.pitch * radians(13) * random[1](t);
    grip.twist = a * radians(16) * random[2](t);
    grip.shift_mm = a * freedom.shift * 1.4 * Eigen::Vector2d(random[3](t), random[4](t));
    grip.indentation_mm = spec.indentation_mm * (1 + 0.25 * random[5](t));
    return grip;
  }
};

Grip wobble(const Clock& clock, int k) { return clock.hand(k, 1.0); }

Grip all_over(const Clock& clock, int k) {
  const double progress = clock.progress(k);
  Grip grip = clock.hand(k, 0.15);
  if (clock.kind == ShapeKind::flat) {  // a closed curve over the face that crosses itself
    const Eigen::Vector2d reach = (clock.half_size_mm.array() - 4.0).max(0.0).min(14.0);
    grip.shift_mm += Eigen::Vector2d(reach.x() * std::sin(2 * kPi * 2 * progress),
                                     reach.y() * std::sin(2 * kPi * 3 * progress));
    return grip;
  }
  if (clock.kind == ShapeKind::rod) {
    grip.roll += radians(430) * progress;  // The last 70 degrees repeat the first ones.
    grip.shift_mm.x() += 3.0 * std::sin(2 * kPi * 2.3 * progress);
    return grip;
  }
  // A spiral from one end to the other, at constant speed on a sphere, and straight back; it starts in the
  // middle of the way back. The windings are closer together than a contact is wide, so that each winding
  // sees part of the previous one again, and the way back crosses them all.
  constexpr double kFarthest = radians(75), kThere = 0.9;
  const double radius_mm = clock.half_size_mm.y(),
               contact_mm = std::sqrt(2 * radius_mm * clock.spec.indentation_mm),
               turns = std::ceil(2 * kFarthest * radius_mm / (0.85 * contact_mm)),
               along = std::fmod(progress + (1 + kThere) / 2, 1.0);
  const double there = std::min(along / kThere, 1.0), back = std::max(along - kThere, 0.0) / (1 - kThere);
  const double latitude = std::asin(std::sin(kFarthest) * (2 * there - 1));
  grip.roll += kPi * turns * latitude / kFarthest;
  grip.pitch += latitude - 2 * kFarthest * back;
  return grip;
}

/// Place 1; lifted; place 2 (45 degrees further); lifted; place 2, from where it rolls back to place 1.
Grip breaks(const Clock& clock, int k) {
  const double progress = clock.progress(k);
  Grip grip = clock.hand(k, 0.7);
  const double away = clock.kind == ShapeKind::flat ? 0 : radians(45);
  const Eigen::Vector2d aside = clock.kind == ShapeKind::flat ? Eigen::Vector2d(5, 3) : Eigen::Vector2d(0, 0);
  const double there = progress < 0.32 ? 0 : progress < 0.72 ? 1 : 1 - (progress - 0.72) / 0.28;
  grip.roll += away * there;
  grip.shift_mm += there * aside;
  const bool lifted = (progress > 0.3 && progress < 0.37) || (progress > 0.65 && progress < 0.72);
  if (lifted) grip.indentation_mm = kLiftedMm;
  return grip;
}

/// Covers the whole object again and again at the speed of a hand, however long the scan is: one turn about x
/// per minute while slowly swinging about y, lifted every 8 s.
Grip tour(const Clock& clock, int k) {
  constexpr double kTurnS = 60, kSwingS = 17 * kTurnS, kTouchS = 8, kLiftS = 0.4;
  const double t = clock.time_s(k) * clock.spec.speed, swing = std::sin(2 * kPi * t / kSwingS);
  Grip grip = clock.hand(k, 0.15);
  if (clock.kind == ShapeKind::flat) {
    const Eigen::Vector2d reach = (clock.half_size_mm.array() - 4.0).max(0.0);
    grip.shift_mm += Eigen::Vector2d(reach.x() * std::sin(2 * kPi * t / kTurnS), reach.y() * swing);
  } else {
    grip.roll += 2 * kPi * t / kTurnS;
    grip.pitch += clock.freedom.pitch * radians(60) * swing;
    if (clock.kind == ShapeKind::rod) grip.shift_mm.x() += (clock.half_size_mm.x() - 4.0) * swing;
  }
  if (std::fmod(clock.time_s(k), kTouchS) > kTouchS - kLiftS) grip.indentation_mm = kLiftedMm;
  return grip;
}

struct MotionEntry : CatalogEntry {
  Grip (*grip)(const Clock&, int);
};
const std::array<MotionEntry, 4> kMotions = {{
    {"wobble", "smooth random slide, roll and twist about one place", wobble},
    {"allover",
     "over all of it and back to the start: bodies in a spiral, rods rolled with sway, flat ones on a curve",
     all_over},
    {"breaks", "place 1, lifted, place 2, lifted, place 2 rolling back to place 1", breaks},
    {"tour", "over all of the object again and again, lifted every 8 s: for long scans", tour},
}};

/// sensor_R_object at rest: flat objects face down to the gel, others as they are.
Eigen::Matrix3d rest(ShapeKind kind) {
  if (kind != ShapeKind::flat) return Eigen::Matrix3d::Identity();
  return Eigen::Vector3d(1, -1, -1).asDiagonal().toDenseMatrix();
}

Eigen::Matrix3d rotation(const Grip& grip, ShapeKind kind) {
  return (Eigen::AngleAxisd(grip.twist, Eigen::Vector3d::UnitZ()) *
          Eigen::AngleAxisd(grip.pitch, Eigen::Vector3d::UnitY()) *
          Eigen::AngleAxisd(grip.roll, Eigen::Vector3d::UnitX()))
             .toRotationMatrix() *
         rest(kind);
}

/// Points of a surface, grouped into runs of neighboring points, so that a search for low points can skip
/// most runs.
class PointRuns {
 public:
  explicit PointRuns(const Mesh& surface) : points_mm_(surface.vertices_mm) {
    constexpr std::size_t kPoints = 128;
    static constexpr float kCellMm = 2.0F;
    const auto cell = [](const Eigen::Vector3f& p) {
      const Eigen::Vector3i at = (p / kCellMm).array().floor().cast<int>();
      return std::array{at.x(), at.y(), at.z()};
    };
    std::stable_sort(points_mm_.begin(), points_mm_.end(),
                     [&](const Eigen::Vector3f& a, const Eigen::Vector3f& b) { return cell(a) < cell(b); });
    for (std::size_t first = 0; first < points_mm_.size(); first += kPoints) {
      Run run{first, std::min(first + kPoints, points_mm_.size()), Eigen::Vector3f::Zero(), 0.0F};
      for (std::size_t k = run.first; k < run.end; ++k)
        run.center_mm += points_mm_[k] / static_cast<float>(run.end - run.first);
      constexpr float kRoundingMm = 1e-3F;
      for (std::size_t k = run.first; k < run.end; ++k)
        run.radius_mm = std::max(run.radius_mm, (points_mm_[k] - run.center_mm).norm() + kRoundingMm);
      runs_.push_back(run);
    }
  }

  /// Calls visit(point, height along `up`) for all points below `limit_mm`, and for some above it, beginning
  /// with the lowest runs. visit() may lower the limit.
  template <class Visit>
  void each_below(const Eigen::Vector3f& up, const float& limit_mm, Visit&& visit) const {
    // A heap of the runs by a lower bound of the heights of their points.
    std::vector<std::pair<float, const Run*>> lowest;
    for (const Run& run : runs_) lowest.emplace_back(up.dot(run.center_mm) - run.radius_mm, &run);
    std::make_heap(lowest.begin(), lowest.end(), std::greater<>());
    while (!lowest.empty() && lowest.front().first <= limit_mm) {
      const Run& run = *lowest.front().second;
      for (std::size_t k = run.first; k < run.end; ++k) visit(points_mm_[k], up.dot(points_mm_[k]));
      std::pop_heap(lowest.begin(), lowest.end(), std::greater<>());
      lowest.pop_back();
    }
  }

 private:
  struct Run {
    std::size_t first, end;
    Eigen::Vector3f center_mm;
    float radius_mm;
  };
  std::vector<Eigen::Vector3f> points_mm_;
  std::vector<Run> runs_;
};

/// Returns where a round body rests: the weighted mean x and y of its lowest points, in object coordinates
/// rotated into the sensor's axes.
Eigen::Vector2d support_center(const Eigen::Matrix3d& sensor_R_object, const PointRuns& surface) {
  const Eigen::Matrix3f turn = sensor_R_object.cast<float>();
  float lowest = 1e9F;
  surface.each_below(turn.row(2), lowest,
                     [&](const Eigen::Vector3f&, float z) { lowest = std::min(lowest, z); });
  Eigen::Vector2d sum = Eigen::Vector2d::Zero();
  double weights = 0;
  constexpr auto kReachMm = static_cast<float>(8 * kSupportSoftnessMm);
  surface.each_below(turn.row(2), lowest + kReachMm, [&](const Eigen::Vector3f& p, float z) {
    const double above = z - lowest;
    if (above > kReachMm) return;
    const double weight = std::exp(-above / kSupportSoftnessMm);
    sum += weight * Eigen::Vector2d(turn.row(0).dot(p), turn.row(1).dot(p));
    weights += weight;
  });
  return sum / weights;
}

/// Returns the smallest height above the gel at rest of all points over the sensor's view, or the smallest
/// height of the whole object if no point is over it. The object is rotated as above and moved by `shift`.
double lowest_in_view(const Eigen::Matrix3d& sensor_R_object, const Eigen::Vector2d& shift,
                      const PointRuns& surface, const SensorGeometry& geometry) {
  const Eigen::Matrix3f turn = sensor_R_object.cast<float>();
  const auto half_width = static_cast<float>(geometry.half_width_mm() - kViewMarginMm);
  const auto half_height = static_cast<float>(geometry.half_height_mm() - kViewMarginMm);
  const Eigen::Vector2f move = shift.cast<float>();
  const auto highest_rest = static_cast<float>(geometry.highest_rest_mm());
  float in_view = 1e9F, anywhere = 1e9F, limit = 1e9F;
  surface.each_below(turn.row(2), limit, [&](const Eigen::Vector3f& p, float z) {
    if (z >= limit) return;
    anywhere = std::min(anywhere, z);
    const float x = turn.row(0).dot(p) + move.x(), y = turn.row(1).dot(p) + move.y();
    if (!(std::abs(x) < half_width && std::abs(y) < half_height)) return;
    in_view = std::min(
        in_view, z - static_cast<float>(geometry.rest_mm(static_cast<double>(x), static_cast<double>(y))));
    limit = in_view + highest_rest;
  });
  return in_view < 1e8F ? in_view : anywhere;
}

/// Returns a Gaussian average over time, near the ends over the values that exist.
template <typename Value>
std::vector<Value> smoothed(const std::vector<Value>& values, double sigma) {
  const int n = static_cast<int>(values.size()), reach = static_cast<int>(3 * sigma);
  std::vector<Value> result;
  for (int k = 0; k < n; ++k) {
    Value sum = 0 * values[0];
    double weights = 0;
    for (int j = std::max(0, k - reach); j <= std::min(n - 1, k + reach); ++j) {
      const double weight = std::exp(-0.5 * (j - k) * (j - k) / (sigma * sigma));
      sum += weight * values[static_cast<std::size_t>(j)];
      weights += weight;
    }
    result.push_back(sum / weights);
  }
  return result;
}

const MotionEntry& find_motion(const MotionSpec& spec) {
  if (spec.frames < 1 || spec.frames > 200'000) throw Error("number of frames must be between 1 and 200000");
  if (!(spec.speed >= 0 && spec.speed <= 5)) throw Error("motion speed factor must be between 0 and 5");
  if (!(spec.indentation_mm >= 0.05 && spec.indentation_mm <= 1.5))
    throw Error("indentation must be between 0.05 and 1.5 mm");
  if (!(spec.frame_rate_hz >= 1 && spec.frame_rate_hz <= 1000))
    throw Error("frame rate must be between 1 and 1000 Hz");
  std::string names;
  for (const MotionEntry& entry : kMotions) {
    if (spec.name == entry.name) return entry;
    names += std::string(names.empty() ? "" : ", ") + entry.name;
  }
  throw Error("unknown motion '" + spec.name + "'; known are " + names);
}

}  // namespace

std::vector<CatalogEntry> motion_catalog() { return {kMotions.begin(), kMotions.end()}; }

std::vector<Pose> make_motion(const MotionSpec& spec, const Shape& shape, const Mesh& surface,
                              const SensorGeometry& geometry) {
  const MotionEntry& entry = find_motion(spec);
  if (surface.vertices_mm.empty()) throw Error("the object has no surface");
  const auto curve = [&spec](std::uint64_t k) { return SmoothRandom(hash(spec.seed, 0x6a0 + k)); };
  const Clock clock{spec,
                    freedom_of(shape.kind()),
                    0.5 * shape.bounds_mm().sizes().head<2>().cast<double>(),
                    shape.kind(),
                    {curve(0), curve(1), curve(2), curve(3), curve(4), curve(5)}};
  const PointRuns points(surface);
  const auto frames = static_cast<std::size_t>(spec.frames);
  std::vector<Grip> grips(frames);
  std::vector<Eigen::Matrix3d> turns(frames);
  std::vector<Eigen::Vector2d> shifts(frames);
  std::vector<double> supports(frames);
  for (std::size_t k = 0; k < frames; ++k) {
    grips[k] = entry.grip(clock, static_cast<int>(k));
    turns[k] = rotation(grips[k], shape.kind());
    // Only a body has to be followed; the axis of a rod and the middle of a plate stay where they are.
    shifts[k] = Eigen::Vector2d::Zero();
    if (shape.kind() == ShapeKind::body) shifts[k] = -support_center(turns[k], points);
  }
  shifts = smoothed(shifts, kLateralSmoothingFrames);
  for (std::size_t k = 0; k < frames; ++k) {
    shifts[k] += grips[k].shift_mm;
    supports[k] = lowest_in_view(turns[k], shifts[k], points, geometry);
  }
  const std::vector<double> steady = smoothed(supports, kSupportSmoothingFrames);
  std::vector<Pose> poses(frames, Pose::Identity());
  for (std::size_t k = 0; k < frames; ++k) {
    double depth = grips[k].indentation_mm;
    if (depth > 0) depth *= std::min(1.0, 0.3 + 0.7 * static_cast<double>(k) / kPressInFrames);
    // Limits what smoothing changes: contact must not be lost, and a ridge must not be pressed in much deeper
    // than intended.
    const double slack = 0.5 * spec.indentation_mm;
    poses[k].linear() = turns[k];
    poses[k].translation() << shifts[k],
        -depth - std::clamp(steady[k], supports[k] - slack, supports[k] + slack);
  }
  return poses;
}

}  // namespace gelslam
