// Computes the background from pictures of the bare gel, and tests whether the gel in them is bare. None of
// these tests is in the papers.
//
// Motion: the pictures, converted to the same light and averaged over 28x28 pixels, are compared with their
// mean; so are the means of the first and the second half of the pictures, which show slow motion.
//
// Imprint: an object that does not move is found by the slopes that the gradient model reads. On bare gel
// they have a smooth error at most. An imprint has large slopes and large curvature after the smooth part is
// removed, so high percentiles of both are multiplied and compared with a limit. Printed dots and the border
// of the picture are left out, because the model is wrong there.

#include "gelslam/surface/background.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/core/text.hpp"
#include "heights/normals.hpp"
#include "heights/poisson.hpp"
#include "photometry/blocks.hpp"
#include "photometry/light.hpp"
#include "slopes/gradient_map.hpp"

namespace gelslam {
namespace {

using namespace surface::detail;

// Two pictures differ if the color difference, averaged over a window of 7x7 blocks (28x28 pixels) around
// each block, exceeds a number of gray levels in at least kMinMovingBlocks windows. The window is that large
// because a moving object covers an area, whereas video compression changes single blocks of 8 or 16 pixels,
// which fill at most a third of it. A contact of 500 pixels covers 30 blocks.
//
// The limit is kMovingLevels for one picture against the mean of all, and kDriftingLevels between the means
// of the first and the second half. In 40 logs of bare gel, compressed as MJPEG, MPEG-4 and H.264 with
// ffmpeg's defaults, the difference that 25 windows exceed is at most 2.4 and 1.6 levels, respectively. For a
// ball that rolls by a quarter of a pixel per frame it is 2.6 and 2.9.
constexpr int kWindowBlocks = 7;
constexpr float kMovingLevels = 3.0F, kDriftingLevels = 2.0F;
constexpr int kMinMovingBlocks = 25;
// In pictures of a camera few pixels are exactly equal to those of the picture before. If more than this
// fraction is, a video codec has skipped them.
constexpr double kRepeatedShare = 0.5;

// Pictures whose brightness differs from that of the last one by less than this fraction are not scaled.
// Lamps flicker by less.
constexpr double kSettledGainError = 0.01;

// The limits of an imprint's strength: the 99th percentile of the local slope times the 99.5th percentile of
// the local curvature in rad per pixel. Bare gels of five sensors (as recorded, recompressed and mirrored)
// reach 0.0024, and 195 ball presses on four sensors at least 0.0035. With the maker's model, 158 bare gels
// reach 0.0039 and presses at least 0.0041. The slope alone would not do: it is 0.13 on bare gel and 0.14 in
// a press.
constexpr double kImprint = 0.0029, kMakersImprint = 0.0040;
// An imprint belongs to the gel itself (a worn spot, or a model of another sensor's light) if every picture
// of the log shows at least this fraction of its slopes. For such imprints, all pictures show 0.83 or more.
// In each of nine logs that begin with an object on the gel, some picture shows at most 0.54.
constexpr double kLastingShare = 0.7;
// The pixels of an imprint are those whose local slope exceeds this fraction of its 99th percentile.
constexpr double kSteepShare = 0.5;
constexpr int kBorderPx = 3 * kBlockPx;  // left out, because the model extrapolates there
constexpr int kMarkerMarginPx = 8;  // left out around printed dots: two sigma of the curvature's smoothing

// A background needs at least this many frames. Fewer could agree by chance, and reduce the noise little.
constexpr std::size_t kMinBareFrames = 3;
// A picture of the log shows the gel of a background if at most this percentage of it differs. A contact
// covers less.
constexpr int kMaxTouchedPercent = 50;
// Stretches whose imprint is more than this many times as strong as the weakest in the log are not bare. On
// bare gel the strength differs by a factor of up to 1.7 between the stretches of a log.
constexpr double kAlikeImprint = 2.0;

// Returns the quantile `share` of the values where `judged` is set, or 0 if it is set nowhere.
double percentile(const cv::Mat1f& values, const cv::Mat1b& judged, double share) {
  std::vector<float> chosen;
  for (int v = 0; v < values.rows; ++v)
    for (int u = 0; u < values.cols; ++u)
      if (judged(v, u) != 0) chosen.push_back(values(v, u));
  return chosen.empty() ? 0.0 : static_cast<double>(quantile_in_place(chosen, share));
}

// Returns the difference between the map smoothed with a narrow and with a broad Gaussian, whose standard
// deviations are given in pixels: the map without noise and without its smooth part.
cv::Mat1f local_part(const cv::Mat1f& map, double smooth_px, double broad_px) {
  cv::Mat1f smooth, broad, local;
  cv::GaussianBlur(map, smooth, cv::Size(), smooth_px, smooth_px, cv::BORDER_REPLICATE);
  cv::GaussianBlur(smooth, broad, cv::Size(), broad_px, broad_px, cv::BORDER_REPLICATE);
  cv::subtract(smooth, broad, local);
  return local;
}

// Removes rows that are brighter or darker because a lamp is dimmed by pulses while a rolling shutter exposes
// row after row. In each row of blocks, the median of the relative change of brightness, times the reference,
// is subtracted from the difference. Brightness is the sum of the colors, which a slope hardly changes,
// because it darkens some colors while it brightens others.
void remove_rows(const cv::Mat3f& reference, cv::Mat3f& difference) {
  std::vector<float> shares;
  for (int v = 0; v < reference.rows; ++v) {
    shares.clear();
    for (int u = 0; u < reference.cols; ++u) {
      const cv::Vec3f &levels = difference(v, u), &of = reference(v, u);
      shares.push_back((levels[0] + levels[1] + levels[2]) / std::max(of[0] + of[1] + of[2], 1.0F));
    }
    difference.row(v) -= static_cast<double>(quantile_in_place(shares, 0.5)) * reference.row(v);
  }
}

// Returns the percentage of the image over which two pictures differ by more than `levels` gray levels after
// the first was converted to the light of the second. Returns 0 below kMinMovingBlocks windows. Both pictures
// are given by their block means.
int differing_percent(const cv::Mat3f& blocks, const cv::Mat3f& reference_blocks, float levels) {
  LightTracker tracker(reference_blocks);
  cv::Mat3f difference = blocks.clone();
  to_background_light(tracker.update(blocks, cv::Mat1b()), difference);
  cv::subtract(difference, reference_blocks, difference);
  remove_rows(reference_blocks, difference);
  cv::blur(difference, difference, cv::Size(kWindowBlocks, kWindowBlocks), cv::Point(-1, -1),
           cv::BORDER_REPLICATE);
  const auto count = std::count_if(difference.begin(), difference.end(), [levels](const cv::Vec3f& color) {
    return color.dot(color) > levels * levels;
  });
  const int total = static_cast<int>(difference.total());
  return count < kMinMovingBlocks ? 0 : std::max(1, 100 * static_cast<int>(count) / total);
}

// Returns an addition to a message about pictures that differ, if strong compression of a video may be the
// cause; else "".
std::string compression_hint(const std::vector<cv::Mat3b>& frames) {
  std::size_t repeated = 0, total = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    total += frames[i].total();
    repeated += static_cast<std::size_t>(
        std::inner_product(frames[i].begin(), frames[i].end(), frames[i - 1].begin(), std::size_t{0},
                           std::plus<>(), [](const cv::Vec3b& a, const cv::Vec3b& b) { return a == b; }));
  }
  const double share = static_cast<double>(repeated) / static_cast<double>(std::max<std::size_t>(total, 1));
  if (share < kRepeatedShare) return "";
  return fmt::format(
      "; or the video is compressed too much ({:.0f} % of the pixels repeat the frame before): "
      "encode it with a higher quality",
      100 * share);
}

std::string find_motion(const std::vector<cv::Mat3b>& frames, const cv::Mat3b& mean) {
  const cv::Mat3f mean_blocks = average_blocks(mean);
  for (std::size_t i = 0; i < frames.size(); ++i) {
    const int percent = differing_percent(average_blocks(frames[i]), mean_blocks, kMovingLevels);
    if (percent == 0) continue;
    return "something moves on the gel: frame " + std::to_string(i + 1) + " of " +
           std::to_string(frames.size()) + " differs from the others over " + std::to_string(percent) +
           " % of the image" + compression_hint(frames);
  }
  if (frames.size() < 2) return {};
  const auto middle = frames.begin() + static_cast<std::ptrdiff_t>(frames.size() / 2);
  const int percent = differing_percent(average_blocks(mean_image({frames.begin(), middle})),
                                        average_blocks(mean_image({middle, frames.end()})), kDriftingLevels);
  if (percent == 0) return {};
  return "something moves slowly on the gel: the first and the second half of the frames differ over " +
         std::to_string(percent) + " % of the image" + compression_hint(frames);
}

// Returns the end (exclusive) of the stretch of consecutive frames from `begin` on that agree with the mean
// of those before them. The frames are given by their block means.
std::size_t end_of_agreement(const std::vector<cv::Mat3f>& blocks, std::size_t begin) {
  cv::Mat3f sum = blocks[begin].clone();
  std::size_t end = begin + 1;
  for (; end < blocks.size(); ++end) {
    cv::Mat3f mean;
    sum.convertTo(mean, CV_32F, 1.0 / static_cast<double>(end - begin));
    if (differing_percent(blocks[end], mean, kMovingLevels) > 0) break;
    sum += blocks[end];
  }
  return end;
}

struct LocalSlopes {
  cv::Mat1f gx, gy;
  LocalSlopes() = default;
  explicit LocalSlopes(const GradientMap& gradient)
      : gx(local_part(gradient.background_gx(), 3.0, 16.0)),
        gy(local_part(gradient.background_gy(), 3.0, 16.0)) {}
};

struct Imprint {
  double slope = 0, curvature = 0;  ///< 99th and 99.5th percentile of the local maps; curvature per pixel
  double depth_mm = 0, limit = kImprint;
  LocalSlopes slopes{};
  cv::Mat1b steep{};  ///< 255 at the pixels of the imprint (see kSteepShare)
  /// Returns the product of slope and curvature divided by its limit. Bare gel has less than 1.
  double strength() const { return slope * curvature / limit; }
  std::string sentence() const {
    return fmt::format("the gel already shows an imprint, about {:.1f} mm deep (local slope {:.2f})",
                       depth_mm, slope);
  }
};

// Measures the imprint in a picture. Printed dots are left out with a margin, because a large dot acts as a
// lens even where its color was interpolated.
Imprint find_imprint(const cv::Mat3b& picture, const GradientModel& model, double pixel_pitch_mm) {
  if (std::min(picture.rows, picture.cols) <= 4 * kBorderPx) return {};
  const GradientMap gradient(model, MarkerFiller(picture).background());
  const cv::Mat1f &gx = gradient.background_gx(), &gy = gradient.background_gy();
  const LocalSlopes local(gradient);
  cv::Mat1f slope, curvature;
  cv::magnitude(local.gx, local.gy, slope);
  PoissonSolver poisson(picture.size());
  const cv::Mat1f height = local_part(poisson.pixels(poisson.solve(gx, gy)), 1.0, 32.0);
  cv::GaussianBlur(divergence(gx, gy), curvature, cv::Size(), 4.0, 4.0, cv::BORDER_REPLICATE);
  cv::Mat1b judged(picture.size(), static_cast<unsigned char>(0));
  judged(cv::Rect(kBorderPx, kBorderPx, judged.cols - 2 * kBorderPx, judged.rows - 2 * kBorderPx)) = 255;
  if (const auto markers = find_marker_dots(picture)) {
    cv::Mat1b around;
    constexpr int side = 2 * kMarkerMarginPx + 1;
    cv::dilate(markers->mask, around, cv::getStructuringElement(cv::MORPH_RECT, cv::Size(side, side)));
    judged.setTo(0, around);
  }
  Imprint imprint{percentile(slope, judged, 0.99),
                  percentile(curvature, judged, 0.995),
                  -pixel_pitch_mm * percentile(height, judged, 0.005),
                  model.wide && model.wide->gives_normals ? kMakersImprint : kImprint,
                  local,
                  judged};
  imprint.steep.setTo(0, slope <= kSteepShare * imprint.slope);
  return imprint;
}

// Returns true if all pictures of a log show the background's imprint, and some of them also differ from the
// background. If none differs, an object may have rested on the gel all the time.
bool is_of_the_gel(const Imprint& imprint, const cv::Mat3b& background, const std::vector<cv::Mat3b>& log,
                   const GradientModel& model) {
  const MarkerFiller markers(background);
  const cv::Mat3f blocks = average_blocks(background);
  bool is_touched = false;
  for (const cv::Mat3b& picture : log) {
    cv::Mat1b covered;
    const LocalSlopes now(GradientMap(model, markers.fill(picture, covered)));
    const auto along_imprint = [&](const LocalSlopes& s) {
      return cv::mean(s.gx.mul(imprint.slopes.gx) + s.gy.mul(imprint.slopes.gy), imprint.steep)[0];
    };
    if (along_imprint(now) < kLastingShare * along_imprint(imprint.slopes)) return false;
    is_touched = is_touched || differing_percent(average_blocks(picture), blocks, kMovingLevels) > 0;
  }
  return is_touched;
}

}  // namespace

EvenLight follow_light(const cv::Mat3f& then, const cv::Mat3f& now) {
  const Light light = LightTracker(then).update(now, {});
  EvenLight result;
  for (std::size_t c = 0; c < 3; ++c) {
    result.gain[c] = light.channels[c][0];
    result.offset[c] = light.channels[c][1];
  }
  return result;
}

cv::Mat3b mean_image(const std::vector<cv::Mat3b>& images) {
  if (images.empty()) throw Error("no background images: need at least one frame without contact");
  cv::Mat3d sum(images.front().size(), cv::Vec3d::all(0.0));
  for (const cv::Mat3b& image : images) {
    if (image.size() != sum.size()) throw Error("background images differ in size");
    cv::accumulate(image, sum);
  }
  cv::Mat3b mean;
  sum.convertTo(mean, CV_8U, 1.0 / static_cast<double>(images.size()));
  return mean;
}

cv::Mat3b background_image(const std::vector<cv::Mat3b>& frames) {
  if (frames.empty()) return mean_image(frames);
  const cv::Scalar last = cv::mean(frames.back());
  std::vector<cv::Mat3b> alike;
  for (const cv::Mat3b& frame : frames) {
    const cv::Scalar brightness = cv::mean(frame);
    cv::Scalar gain;
    bool is_settled = true;
    for (int channel = 0; channel < 3; ++channel) {
      gain[channel] = last[channel] / std::max(brightness[channel], 1.0);
      is_settled = is_settled && std::abs(gain[channel] - 1.0) < kSettledGainError;
    }
    cv::Mat3b brought;
    if (!is_settled) cv::multiply(frame, gain, brought);
    alike.push_back(is_settled ? frame : brought);
  }
  return mean_image(alike);
}

BackgroundCheck check_background(const std::vector<cv::Mat3b>& frames, const GradientModel& model,
                                 const SurfaceOptions& options, const std::string& device_name) {
  const cv::Mat3b mean = background_image(frames);
  BackgroundCheck check;
  const auto markers = find_marker_dots(mean);
  if (markers && !markers->are_readable()) {
    check.markers = true;
    check.reason = markers->sentence();
    return check;
  }
  check.reason = find_motion(frames, mean);
  check.moves = check.contact = !check.reason.empty();
  if (check.contact) return check;
  const Imprint imprint = find_imprint(mean, model, options.pixel_pitch_mm);
  check.contact = imprint.strength() >= 1;
  if (!check.contact) return check;
  check.reason = judge_orientation(MarkerFiller(mean).background(), device_name);
  check.turned = !check.reason.empty();
  append_sentence(check.reason, imprint.sentence());
  return check;
}

std::optional<BareStretch> find_bare_stretch(const std::vector<cv::Mat3b>& frames, std::size_t most,
                                             const GradientModel& model, const SurfaceOptions& options,
                                             const std::vector<cv::Mat3b>& log) {
  struct Candidate : BareStretch {
    std::size_t length;
    double imprint;
    cv::Mat3f blocks;
  };
  std::vector<cv::Mat3f> blocks;
  blocks.reserve(frames.size());
  for (const cv::Mat3b& frame : frames) blocks.push_back(average_blocks(frame));
  std::vector<Candidate> candidates;
  double least_imprint = 1;
  for (std::size_t begin = 0, end = 0; begin < frames.size(); begin = end) {
    end = end_of_agreement(blocks, begin);
    const std::size_t count = std::min(end - begin, most);
    if (count < std::min(kMinBareFrames, most)) continue;
    const auto first = frames.begin() + static_cast<std::ptrdiff_t>(begin);
    const std::vector<cv::Mat3b> used(first, first + static_cast<std::ptrdiff_t>(count));
    const cv::Mat3b mean = background_image(used);
    if (const auto markers = find_marker_dots(mean); markers && !markers->are_readable()) continue;
    if (!find_motion(used, mean).empty()) continue;
    const Imprint imprint = find_imprint(mean, model, options.pixel_pitch_mm);
    if (imprint.strength() < 1)
      least_imprint = std::min(least_imprint, imprint.strength());
    else if (log.empty() || !is_of_the_gel(imprint, mean, log, model))
      continue;
    candidates.push_back({{begin, count, imprint.strength() < 1 ? 0.0 : imprint.depth_mm},
                          end - begin,
                          imprint.strength(),
                          average_blocks(mean)});
  }
  // An object may also rest on the gel for a while. Bare gel is where the imprint is weakest.
  std::erase_if(candidates, [&](const Candidate& c) {
    return c.imprint < 1 && c.imprint > kAlikeImprint * least_imprint;
  });
  if (candidates.empty()) return std::nullopt;
  // Some logs begin with pictures of another light or gel, for example from a camera's old buffers. The rest
  // of the log does not show that gel again.
  const auto is_seen_again = [&blocks](const Candidate& candidate) {
    const auto seen = std::count_if(blocks.begin(), blocks.end(), [&](const cv::Mat3f& frame) {
      return differing_percent(frame, candidate.blocks, kMovingLevels) <= kMaxTouchedPercent;
    });
    return 2 * seen >= std::ssize(blocks);
  };
  auto first = std::find_if(candidates.begin(), candidates.end(), is_seen_again);
  if (first == candidates.end()) first = candidates.begin();
  // Of the stretches that show the same gel, the longest is used, and of equally long ones the last, because
  // old pictures may lie between them, and frames before the background are not tracked.
  const cv::Mat3f gel = first->blocks;
  std::erase_if(candidates,
                [&gel](const Candidate& c) { return differing_percent(c.blocks, gel, kMovingLevels) > 0; });
  return *std::max_element(candidates.rbegin(), candidates.rend(),  // of equally long ones the last
                           [](const auto& a, const auto& b) { return a.length < b.length; });
}

}  // namespace gelslam
