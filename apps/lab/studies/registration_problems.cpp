#include "registration_problems.hpp"

#include <algorithm>
#include <map>
#include <opencv2/imgproc.hpp>
#include <set>

#include "gelslam/evaluation/run_and_truth.hpp"
#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "gelslam/surface/background.hpp"
#include "gelslam/surface/model_file.hpp"
#include "gelslam/surface/surface_estimator.hpp"

namespace gelslam::lab {
namespace {

struct Pair {
  int reference, target;  // indices of the truth
};

std::vector<Pair> choose_pairs(const GroundTruth& truth, const ProblemChoice& choice) {
  const int count = static_cast<int>(truth.start_T_currs.size());
  const auto touches = [&](int i) { return truth.start_T_currs[static_cast<std::size_t>(i)].has_value(); };
  const int stride = std::max(choice.stride, count / choice.most_references);
  std::vector<Pair> pairs;
  for (int reference = stride / 2; reference < count; reference += stride)
    for (const int gap : choice.gaps)
      if (const int target = reference + gap;
          target < count && touches(reference) && touches(target) && touches(target - 1))
        pairs.push_back({reference, target});
  return pairs;
}

cv::Mat3b resized(const cv::Mat3b& picture, cv::Size size) {
  if (picture.size() == size) return picture;
  cv::Mat3b result;
  cv::resize(picture, result, size, 0, 0, size.width < picture.cols ? cv::INTER_AREA : cv::INTER_CUBIC);
  return result;
}

/// Surfaces of the frames at the given indices of the truth; all frames are looked at, as light is followed
/// from one to the next.
std::map<int, SurfacePtr> surfaces_of(const std::filesystem::path& folder, cv::Size size,
                                      const GroundTruth& truth, const std::set<int>& wanted) {
  const Config config = resolve_config({folder, {}, {}, {}, false});
  const auto source = open_frame_source(folder, config.sensor);
  std::vector<cv::Mat3b> background;
  std::optional<SurfaceEstimator> estimator;
  std::map<int, SurfacePtr> surfaces;
  for (int index = -truth.background_frames; !wanted.empty() && index <= *wanted.rbegin(); ++index) {
    const std::optional<TactileImage> image = source->next();
    if (!image) break;
    const cv::Mat3b picture = resized(image->bgr, size);
    if (index < 0) {
      background.push_back(picture.clone());
      continue;
    }
    if (!estimator) {
      SurfaceOptions options = config.surface;
      options.pixel_pitch_mm = config.sensor.pixel_pitch_mm * config.sensor.width_px / size.width;
      estimator.emplace(read_model(config.sensor.calibration_model_path), mean_image(background), options);
    }
    SurfacePtr surface = estimator->estimate(picture);
    if (wanted.contains(index)) surfaces[index] = std::move(surface);
  }
  return surfaces;
}

}  // namespace

ProblemSet load_problems(const std::filesystem::path& folder, cv::Size size, const ProblemChoice& choice) {
  const GroundTruth truth = read_ground_truth(folder);
  const std::vector<Pair> pairs = choose_pairs(truth, choice);
  std::set<int> wanted;
  for (const Pair& pair : pairs) wanted.insert({pair.reference, pair.target});
  ProblemSet set;
  const std::map<int, SurfacePtr> surfaces = surfaces_of(folder, size, truth, wanted);
  const auto pose = [&](int index) { return *truth.start_T_currs[static_cast<std::size_t>(index)]; };
  int reference = -1;
  for (const Pair& pair : pairs) {
    if (!surfaces.contains(pair.target)) continue;
    if (pair.reference != reference) {
      reference = pair.reference;
      set.references.push_back(surfaces.at(reference));
    }
    RegistrationProblem problem;
    problem.reference = set.references.size() - 1;
    problem.target = surfaces.at(pair.target);
    if (!choice.frames_missing) problem.start = pose(pair.target - 1).inverse() * pose(reference);
    problem.truth = pose(pair.target).inverse() * pose(reference);
    problem.gap = pair.target - pair.reference;
    set.problems.push_back(problem);
  }
  return set;
}

}  // namespace gelslam::lab
