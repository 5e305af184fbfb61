// Study: localization in known maps, made of runs and of meshes, with touches of known pose. Reported: how
// often the pose is found at the first touch and after rolling on, its accuracy, the time, and whether a
// wrong pose is reported as certain.
#include <cmath>
#include <ctime>
#include <iostream>
#include <optional>
#include <random>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/localization/localizer.hpp"
#include "gelslam/localization/maps.hpp"
#include "gelslam/simulation/optics.hpp"
#include "gelslam/simulation/simulator.hpp"
#include "gelslam/slam/gel_slam.hpp"
#include "gelslam/surface/surface_estimator.hpp"
#include "judgement.hpp"
#include "simulated_frames.hpp"
#include "study.hpp"
#include "touch_studio.hpp"

namespace gelslam::lab {
namespace {

constexpr float kMapMeshSpacingMm = 0.1F, kCoarseSpacingMm = 0.5F;
constexpr double kFrameS = 0.04;
constexpr int kMapFrames = 300;
// After a touch: enough for about two more touches of other places.
constexpr int kRollFrames = 24, kRollStride = 2;

struct LocalizationArguments {
  std::vector<std::string> objects = {"pebble", "peanut", "pebble:2", "peanut:2", "coin",
                                      "plank",  "golf",   "knurl",    "sphere"};
  int trials = 100;
  std::filesystem::path out;
};

struct Object {
  Mesh mesh, coarse;
  ShapePtr shape;
};

Object make_object(const std::string& name) {
  const std::size_t colon = name.find(':');
  ShapeSpec spec;
  spec.name = name.substr(0, colon);
  if (colon != std::string::npos) spec.seed = std::stoul(name.substr(colon + 1));
  const Mesh mesh = make_shape(spec)->mesh(kMapMeshSpacingMm);
  const ShapePtr made = make_mesh_shape(mesh);
  return {mesh, made->mesh(kCoarseSpacingMm), made};
}

std::vector<Pose> motion(const Object& object, int frames, std::uint64_t seed) {
  MotionSpec spec;
  spec.name = "allover";
  spec.frames = frames;
  spec.seed = seed;
  return make_motion(spec, *object.shape, object.coarse, {});
}

/// The simulated sensor: reads surfaces in the way the program does.
class Sensor {
 public:
  explicit Sensor(const GradientModel& model)
      : model_(model), optics_({}, {}), background_(bare_gel(optics_)) {
    restart();
  }
  /// Resets the tracking of changes of light.
  void restart() { estimator_.emplace(model_, background_, SurfaceOptions{}); }
  SurfacePtr read(const Shape& shape, const Pose& sensor_T_object) {
    return estimator_->estimate(optics_.render(press_object(shape, sensor_T_object, {}), ++picture_, true));
  }

 private:
  GradientModel model_;
  Optics optics_;
  cv::Mat3b background_;
  std::optional<SurfaceEstimator> estimator_;
  std::int64_t picture_ = 0;
};

/// A map, with the pose of the object in it.
struct StudyMap {
  std::string kind;
  std::shared_ptr<const SurfaceMap> map;
  Pose map_T_object = Pose::Identity();
};

StudyMap map_of_run(const Object& object, Sensor& sensor) {
  const std::vector<Pose> poses = motion(object, kMapFrames, 1);
  GelSlam slam(SlamOptions{});
  StageTimer timer;
  sensor.restart();
  for (std::size_t k = 0; k < poses.size(); ++k)
    slam.process(static_cast<std::int64_t>(k), kFrameS * static_cast<double>(k),
                 sensor.read(*object.shape, poses[k]), timer);
  const SlamMap map = slam.finish();
  if (map.anchor_frame < 0) throw Error("the object was never touched");
  return {"run", std::make_shared<const SurfaceMap>(posed_surfaces(snapshot_of(map)), SlamOptions{}),
          poses[static_cast<std::size_t>(map.anchor_frame)]};
}

StudyMap map_of_mesh(const Object& object) {
  NoProgress progress;
  return {"mesh",
          std::make_shared<const SurfaceMap>(make_mesh_map(object.mesh, {}, progress).patches, SlamOptions{}),
          Pose::Identity()};
}

struct PoseError {
  double mm = 0, deg = 0;
  bool right() const { return mm < kWrongMm && deg < kWrongDeg; }
};

PoseError error_of(const PlaceHypothesis& found, const Pose& map_T_sensor) {
  const Pose error = map_T_sensor.inverse() * found.map_T_sensor.pose;
  return {error.translation().norm(), rotation_angle_rad(error) * 180 / M_PI};
}

/// Results of the trials in one map.
struct Score {
  int trials = 0, frames = 0, first_right = 0, first_sure = 0, later_sure = 0, sure_wrong = 0;
  std::vector<double> mm, deg, first_ms, hypotheses;

  void add_sure(const Localization& found, const Pose& truth) {
    ++frames;
    if (found.status != PlaceStatus::localized) return;
    const PoseError error = error_of(found.hypotheses.front(), truth);
    sure_wrong += !error.right();
    mm.push_back(error.mm);
    deg.push_back(error.deg);
  }
};

/// A touch, and the following frames while the object is rolled on.
struct Trial {
  std::vector<Pose> sensor_T_object;
  std::vector<SurfacePtr> surfaces;
};

/// Makes a trial at a random pose of another motion than that of the map, with a random twist and a small
/// tilt.
Trial make_trial(const Object& object, const std::vector<Pose>& poses, Sensor& sensor,
                 std::mt19937_64& random) {
  const auto uniform = [&random](double low, double high) {
    return low + (high - low) * static_cast<double>(random() >> 11) * 0x1p-53;
  };
  const auto first =
      static_cast<std::size_t>(uniform(0, static_cast<double>(poses.size()) - kRollFrames - 1));
  Pose held = Pose::Identity();
  held.rotate(Eigen::AngleAxisd(uniform(-M_PI, M_PI), Eigen::Vector3d::UnitZ()));
  held.rotate(Eigen::AngleAxisd(uniform(-0.08, 0.08), Eigen::Vector3d::UnitX()));
  held.rotate(Eigen::AngleAxisd(uniform(-0.08, 0.08), Eigen::Vector3d::UnitY()));
  // In two statements, because operands are evaluated in no defined order.
  const double y_mm = uniform(-1, 1), x_mm = uniform(-1, 1);
  held.pretranslate(Eigen::Vector3d(x_mm, y_mm, 0));
  const double depth_mm = uniform(0.8, 1.2) * ordinary_indentation_mm(object.shape->kind());
  Trial trial;
  sensor.restart();
  for (std::size_t k = 0; k <= kRollFrames; k += kRollStride) {
    const std::optional<Pose> pose = settle_object(*object.shape, held * poses[first + k], depth_mm, {});
    if (!pose) break;
    trial.sensor_T_object.push_back(*pose);
    trial.surfaces.push_back(sensor.read(*object.shape, *pose));
  }
  return trial;
}

/// Scores a trial if the map shows its first touch, and counts poses that are certain and wrong.
void judge(const Trial& trial, const StudyMap& map, Score& score) {
  if (trial.surfaces.empty() || trial.surfaces.front()->contact_mm2() < TrackerOptions{}.min_contact_mm2)
    return;
  const auto truth = [&](std::size_t k) {
    return Pose(map.map_T_object * trial.sensor_T_object[k].inverse());
  };
  const NormalFlowReference first(trial.surfaces.front(), {});
  const bool shown = map.map->fit(first, {truth(0)}, PlacePrior::odometry).covered;
  Localizer localizer(map.map, {});
  bool sure = false;
  for (std::size_t k = 0; k < trial.surfaces.size() && !sure; ++k) {
    const std::clock_t start = std::clock();  // Processor time, which does not include other programs.
    const Localization found =
        *localizer
             .process(static_cast<std::int64_t>(k), kRollStride * kFrameS * static_cast<double>(k),
                      trial.surfaces[k])
             .localization;
    const double ms = 1000.0 * static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
    score.add_sure(found, truth(k));
    sure = found.status == PlaceStatus::localized;
    score.later_sure += shown && sure;
    if (k > 0 || !shown) continue;
    ++score.trials;
    score.first_ms.push_back(ms);
    score.hypotheses.push_back(static_cast<double>(found.hypotheses.size()));
    score.first_sure += sure;
    score.first_right += !found.hypotheses.empty() && error_of(found.hypotheses.front(), truth(0)).right();
  }
}

Json middle(std::vector<double> values) {
  return values.empty() ? Json(nullptr) : Json(median(std::move(values)));
}

Json row_of(const std::string& name, const StudyMap& map, const Score& score) {
  const auto percent = [&](int count) {
    return score.trials > 0 ? Json(100.0 * count / score.trials) : Json(nullptr);
  };
  Json row;
  row["object"] = name;
  row["map"] = map.kind;
  row["keyframes"] = map.map->keyframe_count();
  row["trials"] = score.trials;
  row["first right %"] = percent(score.first_right);
  row["certain at first %"] = percent(score.first_sure);
  row["certain rolled on %"] = percent(score.later_sure);
  row["hypotheses"] = middle(score.hypotheses);
  row["certain frames"] = score.mm.size();
  row["certain but wrong"] = score.sure_wrong;
  row["median mm"] = middle(score.mm);
  row["median deg"] = middle(score.deg);
  row["first touch ms"] = middle(score.first_ms);
  return row;
}

void run(const LocalizationArguments& arguments) {
  Sensor sensor(flat_sensor_model());
  Json rows = Json::array();
  StudyCases cases(arguments.objects.size());
  for (const std::string& name : arguments.objects) {
    cases.begin(name);
    const Object object = make_object(name);
    const std::vector<StudyMap> maps = {map_of_mesh(object), map_of_run(object, sensor)};
    std::vector<Score> scores(maps.size());
    const std::vector<Pose> poses = motion(object, 1000, 2);
    std::mt19937_64 random(7);
    for (int k = 0; k < arguments.trials; ++k) {
      const Trial trial = make_trial(object, poses, sensor, random);
      for (std::size_t m = 0; m < maps.size(); ++m) judge(trial, maps[m], scores[m]);
    }
    for (std::size_t m = 0; m < maps.size(); ++m) {
      rows.push_back(row_of(name, maps[m], scores[m]));
      std::cerr << rows.back().dump() << "\n";
    }
    write_study(arguments.out, "localize", rows);
  }
  print_csv(rows);
}

}  // namespace

void add_localize(CLI::App& lab) {
  const auto arguments = std::make_shared<LocalizationArguments>();
  CLI::App* command = add_study(
      lab, "localize",
      "Find touches of known objects in maps of runs and of meshes; count what is certain but wrong",
      arguments, run);
  add_list(*command, "--objects", arguments->objects,
           "Objects (see gelslam simulate --list), NAME or NAME:SEED");
  command->add_option("--trials", arguments->trials, "Touches per object")->capture_default_str();
  command->add_option("-o,--output", arguments->out, "Folder for localize.json");
  command->footer("Example: gelslam-lab localize --objects coin,peanut --trials 20");
}

}  // namespace gelslam::lab
