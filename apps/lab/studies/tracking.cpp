// Study: where the program gives up. The Tracker as it runs (retries, search far away, keyframes) follows
// simulated and recorded touches while motion, overlap, light, dirt and noise get worse, beside the tracker
// without the search and one registration per frame, each from the pose of the frame before.

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>
#include <optional>
#include <string>
#include <tuple>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/frontend/tracker.hpp"
#include "judgement.hpp"
#include "protocols/trials.hpp"
#include "registration_problems.hpp"
#include "simulated_frames.hpp"
#include "study.hpp"
#include "touch_studio.hpp"

namespace gelslam::lab {
namespace {

namespace fs = std::filesystem;
using Names = std::vector<std::string>;

const Names kTrackedObjects = {"pebble", "peanut", "coin", "plank", "golf", "knurl"};
const Names kTrackedRoundObjects = {"pebble", "peanut", "golf", "knurl"};
constexpr int kPictures = 24;      // of a motion seen as it comes, at 25 Hz
constexpr int kLeftOutSteps = 12;  // of a motion of which pictures are left out

struct TrackingArguments {
  std::vector<fs::path> data;
  Names charts;
  int places = TouchSpec::kPlaces;  // of each object
  bool quick = false, simulated_only = false;
  fs::path out;
};

/// The tracker as the program runs it, and one that stays where it is when track is lost.
struct Follower {
  const char* name;
  bool relocalize;
};

constexpr Follower kTrackers[] = {{"tracker", true}, {"tracker without search", false}};
constexpr const char* kAlone = "registration alone";

/// target_T_reference, true.
Pose true_step(const TouchStream& stream, std::size_t reference, std::size_t target) {
  return stream.sensor_T_object[target] * stream.sensor_T_object[reference].inverse();
}

/// Adds the steps from one frame to the next.
void follow_alone(const TouchStream& stream, Tally& tally) {
  const std::shared_ptr<const Registrar> registrar = make_normal_flow({});
  for (std::size_t k = 1; k < stream.surfaces.size(); ++k) {
    const RegistrationResult result =
        registrar->prepare(stream.surfaces[k - 1])->register_to(*stream.surfaces[k], Pose::Identity());
    tally.add(judge_pose_error(result.target_T_reference, true_step(stream, k - 1, k), result.observable,
                               result.ok()));
  }
}

/// Steps are from the last picture that was tracked; a trial that begins anew has lost the one before.
void follow(const TouchStream& stream, const Follower& follower, Tally& tally) {
  TrackerOptions options;
  options.relocalize = follower.relocalize;
  Tracker tracker(options);
  TrackedFrame last;
  for (std::size_t k = 0; k < stream.surfaces.size(); ++k) {
    TrackedFrame now = tracker.track(static_cast<std::int64_t>(k), stream.step_s * static_cast<double>(k),
                                     stream.surfaces[k]);
    if (k > 0) {
      const bool tracked = now.status == TrackStatus::tracked && now.trial == last.trial;
      const Pose step = now.trial_T_frame.inverse() * last.trial_T_frame;
      tally.add(judge_pose_error(step, true_step(stream, static_cast<std::size_t>(last.frame), k),
                                 now.registration.observable, tracked));
    }
    if (now.trial >= 0) last = std::move(now);
  }
}

/// Of all charts, levels and followers; charts in the order of `charts`.
class TrackingStudy {
 public:
  TrackingStudy(Names all_charts, fs::path out) : charts_(std::move(all_charts)), out_(std::move(out)) {}

  void add(const std::string& chart, double level, const TouchStream& stream) {
    follow_alone(stream, tallies_[{chart, level, kAlone}]);
    for (const Follower& follower : kTrackers)
      follow(stream, follower, tallies_[{chart, level, follower.name}]);
    write_study(out_, "tracking", rows());
  }

  Json rows() const {
    Json rows = Json::array();
    for (const std::string& chart : charts_)
      for (const auto& [key, tally] : tallies_) {
        if (std::get<0>(key) != chart) continue;
        rows.push_back({{"chart", chart},
                        {"level", std::get<1>(key)},
                        {"follower", std::get<2>(key)},
                        {"steps", tally.cases},
                        {"followed", tally.share(tally.tracked_right)},
                        {"silent_failures", tally.share(tally.silent)},
                        {"lost", tally.share(tally.cases - tally.tracked)}});
      }
    return rows;
  }

 private:
  Names charts_;
  fs::path out_;
  std::map<std::tuple<std::string, double, std::string>, Tally> tallies_;
};

/// A chart's levels, and what each does to a touch.
struct Chart {
  std::string name;
  std::vector<double> levels;
  void (*set)(TouchSpec& spec, double level);
  const Names* objects = &kTrackedObjects;
};

Pose turned_by(double deg, const Eigen::Vector3d& axis) {
  return Pose(Eigen::AngleAxisd(deg / kDegreesPerRadian, axis));
}

/// Along the gel, at each place another way.
Eigen::Vector3d way(int place) {
  const double angle = 0.4 + 2 * M_PI * place / TouchSpec::kPlaces;
  return {std::cos(angle), std::sin(angle), 0};
}

/// The object jumps between two pictures.
const std::vector<Chart> kJumps = {
    {"slid at once",
     {0.25, 0.5, 1, 1.5, 2, 3, 4, 5},
     [](TouchSpec& spec, double mm) { spec.overlap = 1, spec.moved.translation() = mm * way(spec.place); }},
    {"twisted at once",
     {2.5, 5, 10, 15, 20, 30, 45, 60},
     [](TouchSpec& spec, double deg) {
       spec.overlap = 1, spec.moved = turned_by(spec.place % 2 == 0 ? deg : -deg, Eigen::Vector3d::UnitZ());
     }},
    {"tilted at once",
     {2.5, 5, 10, 15, 20, 30, 45},
     [](TouchSpec& spec, double deg) { spec.overlap = 1, spec.moved = turned_by(deg, way(spec.place)); }},
    {"overlap left", {0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1}, [](TouchSpec& spec, double overlap) {
       spec.overlap = overlap;
     }}};

/// The object rolls on as a hand moves it, under worse and worse conditions.
const std::vector<Chart> kConditions = {
    {"noise", {0.5, 1, 2, 4, 8}, [](TouchSpec& spec, double gain) { spec.noise_gain = gain; }},
    {"light drift",
     {0, 0.1, 0.2, 0.3, 0.5},
     [](TouchSpec& spec, double change) { spec.light_change = change; }},
    {"light jump",
     {0, 0.05, 0.1, 0.2, 0.3},
     [](TouchSpec& spec, double change) { spec.light_change = change, spec.light_jumps = true; }},
    {"dirt",
     {0, 30, 120, 250, 500},
     [](TouchSpec& spec, double grains) { spec.grains = static_cast<int>(grains); }},
    {"depth", {0.15, 0.25, 0.4, 0.7, 1.0, 1.5}, [](TouchSpec& spec, double depth) { spec.depth = depth; }},
    {"texture",
     {1, 0.7, 0.4, 0.2, 0.1, 0.05, 0},
     [](TouchSpec& spec, double texture) { spec.texture = texture; },
     &kTrackedRoundObjects}};

const std::vector<double> kLeftOut = {0, 1, 2, 3, 5, 7, 9, 11, 14, 17};
constexpr const char* kLeftOutSimulated = "pictures left out";
constexpr const char* kLeftOutRecorded = "pictures left out (recorded)";

Names chart_names() {
  Names names = {kLeftOutSimulated, kLeftOutRecorded};
  for (const auto* charts : {&kJumps, &kConditions})
    for (const Chart& chart : *charts) names.push_back(chart.name);
  return names;
}

class Simulated {
 public:
  Simulated(const TrackingArguments& arguments, TrackingStudy& study)
      : arguments_(arguments), study_(study), studio_(quickly_trained_model()) {}

  /// Charts inside places: one motion is pressed once for all that can be done to its pictures.
  void run() {
    const int places = arguments_.quick ? 1 : arguments_.places;
    StudyCases cases(kTrackedObjects.size() * static_cast<std::size_t>(places));
    for (const std::string& object : kTrackedObjects)
      for (int place = 0; place < places; ++place) {
        cases.begin(object + ", place " + std::to_string(place));
        TouchSpec spec;
        spec.object = object;
        spec.place = place;
        for (const Chart& chart : kJumps)
          each_level(chart, spec, [&](const TouchSpec& s) { return jump(s); });
        if (place % 2 != 0) continue;  // 24 steps from one place
        for (const Chart& chart : kConditions)
          each_level(chart, spec, [&](const TouchSpec& s) { return studio_.roll(s, kPictures, 1); });
        if (wanted(kLeftOutSimulated))
          for (const double left_out : chosen(kLeftOut))
            study_.add(kLeftOutSimulated, left_out,
                       studio_.roll(spec, kLeftOutSteps + 1, static_cast<int>(left_out) + 1));
      }
  }

  bool wanted(const std::string& chart) const {
    return arguments_.charts.empty() ||
           std::find(arguments_.charts.begin(), arguments_.charts.end(), chart) != arguments_.charts.end();
  }

  std::vector<double> chosen(const std::vector<double>& levels) const {
    std::vector<double> some;
    for (std::size_t k = 0; k < levels.size(); k += arguments_.quick ? 3 : 1) some.push_back(levels[k]);
    return some;
  }

 private:
  template <class Make>
  void each_level(const Chart& chart, const TouchSpec& ordinary, const Make& make) {
    const bool mine =
        std::find(chart.objects->begin(), chart.objects->end(), ordinary.object) != chart.objects->end();
    if (!wanted(chart.name) || !mine) return;
    for (const double level : chosen(chart.levels)) {
      TouchSpec spec = ordinary;
      chart.set(spec, level);
      study_.add(chart.name, level, make(spec));
    }
  }

  TouchStream jump(const TouchSpec& spec) {
    const TouchPair pair = studio_.make(spec);
    return {{pair.reference, pair.target}, {pair.reference_T_object, pair.target_T_object}, 0.04};
  }

  const TrackingArguments& arguments_;
  TrackingStudy& study_;
  TouchStudio studio_;
};

/// Every frame of a sequence that touches and whose pose is known.
TouchStream recorded(const fs::path& folder) {
  TouchStream stream;
  for (const BenchmarkTrial& trial : find_trials({folder})) {
    TrialFrames frames(trial, {});
    while (const std::optional<TrialFrame> frame = frames.next()) {
      if (!frame->start_T_frame) continue;
      stream.surfaces.push_back(frame->surface);
      stream.sensor_T_object.push_back(frame->start_T_frame->inverse());
    }
  }
  return stream;
}

TouchStream every(const TouchStream& all, std::size_t stride) {
  TouchStream some;
  some.step_s = all.step_s * static_cast<double>(stride);
  for (std::size_t k = 0; k < all.surfaces.size(); k += stride) {
    some.surfaces.push_back(all.surfaces[k]);
    some.sensor_T_object.push_back(all.sensor_T_object[k]);
  }
  return some;
}

void run(const TrackingArguments& arguments) {
  TrackingStudy study(chart_names(), arguments.out);
  Simulated simulated(arguments, study);
  simulated.run();
  std::vector<fs::path> folders;
  if (simulated.wanted(kLeftOutRecorded) && !arguments.simulated_only)
    folders = arguments.data.empty() ? sequence_folders({"track_"}) : arguments.data;
  StudyCases cases(folders.size());
  for (const fs::path& folder : folders) {
    cases.begin(name_of(folder));
    const TouchStream all = recorded(folder);
    for (const double left_out : simulated.chosen(kLeftOut))
      study.add(kLeftOutRecorded, left_out, every(all, static_cast<std::size_t>(left_out) + 1));
  }
  const Json rows = study.rows();
  if (rows.empty()) throw Error("there is nothing to follow: of these charts none was chosen");
  print_table(rows);
}

}  // namespace

void add_tracking(CLI::App& lab) {
  const auto arguments = std::make_shared<TrackingArguments>();
  CLI::App* command = add_study(
      lab, "tracking", "Measure how far the tracker follows, against what makes it hard", arguments, run);
  command->add_option(
      "DATA", arguments->data,
      "Data folders with truth, for pictures left out (default: GELSLAM_DATA/sequences/track_*)");
  add_list(*command, "--charts", arguments->charts, "Only these (default: all)")
      ->check(CLI::IsMember(chart_names()));
  command->add_option("--places", arguments->places, "Of each object")
      ->check(CLI::Range(1, TouchSpec::kPlaces))
      ->capture_default_str();
  command->add_flag("--quick", arguments->quick, "One place of each object, every third level");
  command->add_flag("--simulated-only", arguments->simulated_only, "Without the sequences");
  command->add_option("-o,--output", arguments->out, "Folder for tracking.csv and .json");
  command->footer("Example: gelslam-lab tracking --places 1 -o STUDY && scripts/plot_tracking.py STUDY");
}

}  // namespace gelslam::lab
