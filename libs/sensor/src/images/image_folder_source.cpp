#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/core/trajectory.hpp"
#include "images/sources.hpp"

namespace gelslam::detail {
namespace {

namespace fs = std::filesystem;

/// When the pictures of a folder were taken.
struct FolderTimes {
  std::vector<std::int64_t> unix_us = {};  ///< from their names; empty: these are no times
  std::vector<std::int64_t> numbers;       ///< of the frames, from 0, with gaps where names leave some out
  double rate_hz;
  std::string doubt = {};  ///< for people

  double time_s(std::size_t i) const {
    return unix_us.empty() ? static_cast<double>(numbers[i]) / rate_hz
                           : 1e-6 * static_cast<double>(unix_us[i] - unix_us.front());
  }
  std::string words() const {
    const std::int64_t missing = numbers.back() + 1 - std::ssize(numbers);
    return (unix_us.empty() ? "" : ", times of their names") +
           (missing > 0 ? ", " + counted(missing, "number") + " left out" : std::string());
  }
};

/// The digits that a name ends with, and those behind a point: "cam0-1403636579.763" has "1403636579", "763".
/// So has "1403636579_763" where the names are of `seconds_nanoseconds`.
std::pair<std::string, std::string> number_in(const fs::path& image, bool seconds_nanoseconds = false) {
  const std::string stem = image.stem().string();
  const auto digits_before = [&](std::size_t end) {
    std::size_t begin = end;
    while (begin > 0 && stem[begin - 1] >= '0' && stem[begin - 1] <= '9') --begin;
    return stem.substr(begin, end - begin);
  };
  const std::string last = digits_before(stem.size());
  const std::size_t point = stem.size() - last.size();
  if (point == 0 || (stem[point - 1] != '.' && !(seconds_nanoseconds && stem[point - 1] == '_')))
    return {last, ""};
  const std::string whole = digits_before(point - 1);
  return whole.empty() ? std::pair(last, std::string()) : std::pair(whole, last);
}

/// Of a name that is a time since 1970 as datasets write it: seconds (10 digits, perhaps with more behind a
/// point, or with a number of nanoseconds), milliseconds (13), microseconds (16) or nanoseconds (19).
std::optional<std::int64_t> unix_us_of_name(const fs::path& image, bool seconds_nanoseconds) {
  auto [whole, behind] = number_in(image, seconds_nanoseconds);
  if (whole.size() != 10 &&
      (!behind.empty() || (whole.size() != 13 && whole.size() != 16 && whole.size() != 19)))
    return std::nullopt;
  if (seconds_nanoseconds && behind.size() < 9) behind.insert(0, 9 - behind.size(), '0');
  const std::int64_t unix_us = std::stoll((whole + behind + "000000").substr(0, 16));
  constexpr std::int64_t kFirstUs = 1'000'000'000'000'000;  // 2001
  return unix_us >= kFirstUs && unix_us < kMaxUnixUs ? std::optional(unix_us) : std::nullopt;
}

std::vector<std::int64_t> steps_of(const std::vector<std::int64_t>& values) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < values.size(); ++i) steps.push_back(values[i] - values[i - 1]);
  return steps;
}

bool increases(const std::vector<std::int64_t>& values) {
  return std::ranges::adjacent_find(values, std::greater_equal<>()) == values.end();
}

/// Frame numbers from 0 by the numbers in names, where most of these differ by the same step and the others
/// by several: a recorder that left some out. Else all in a row.
std::vector<std::int64_t> frame_numbers(const std::vector<fs::path>& images) {
  std::vector<std::int64_t> in_a_row, named;
  for (const fs::path& image : images) {
    in_a_row.push_back(std::ssize(in_a_row));
    const std::string digits = number_in(image).first;
    if (!digits.empty() && digits.size() < 10) named.push_back(std::stoll(digits));
  }
  if (named.size() != images.size() || named.size() < 3 || !increases(named)) return in_a_row;
  const std::vector<std::int64_t> steps = steps_of(named);
  const std::int64_t step = *std::ranges::min_element(steps);
  const bool usual = 2 * std::ranges::count(steps, step) > std::ssize(steps);
  if (!usual || std::ranges::any_of(steps, [&](std::int64_t s) { return s % step != 0; })) return in_a_row;
  const std::int64_t first = named.front();
  for (std::int64_t& number : named) number = (number - first) / step;
  return named;
}

/// Where a clock was set back, pictures of two times mix: two steps together make the usual one. Else "".
std::string doubt_of(const std::vector<std::int64_t>& unix_us, std::int64_t usual_us,
                     const std::vector<fs::path>& images) {
  constexpr int kFewestMixed = 6;
  int mixed = 0;
  for (std::size_t i = 2; i < unix_us.size(); ++i) {
    mixed = 5 * std::abs(unix_us[i] - unix_us[i - 2] - usual_us) < usual_us ? mixed + 1 : 0;
    if (mixed == kFewestMixed)
      return images[i].string() +
             ": taken after half of the usual time, as several before it; if the clock "
             "was set back there, their order is wrong";
  }
  return "";
}

/// Brings the images into the order of their names' times, if they have some.
FolderTimes times_of(std::vector<fs::path>& images, double profile_rate_hz) {
  FolderTimes times{.numbers = frame_numbers(images), .rate_hz = profile_rate_hz};
  const bool seconds_nanoseconds = std::ranges::any_of(
      images, [](const fs::path& image) { return number_in(image, true).second.size() == 9; });
  std::map<std::int64_t, fs::path> timed;
  std::string second;  // name of the same time, or without one
  for (const fs::path& image : images) {
    const auto time = unix_us_of_name(image, seconds_nanoseconds);
    if (!time || !timed.emplace(*time, image).second) second = image.string();
  }
  if (2 * timed.size() <= images.size() || timed.size() < 2) return times;
  if (!second.empty()) {
    times.doubt = second + fmt::format(": its name gives no time of its own; times are counted at {:g} Hz",
                                       profile_rate_hz);
    return times;
  }
  images.clear();
  for (auto& [time_us, image] : timed) {
    times.unix_us.push_back(time_us);
    images.push_back(std::move(image));
  }
  const std::int64_t usual_us = quantile(steps_of(times.unix_us), 0.5);
  times.rate_hz = 1e6 / static_cast<double>(usual_us);
  times.doubt = doubt_of(times.unix_us, usual_us, images);
  return times;
}

class ImageFolderSource final : public RawFrameSource {
 public:
  ImageFolderSource(fs::path folder, std::vector<fs::path> images, double rate_hz)
      : folder_(std::move(folder)), images_(std::move(images)), times_(times_of(images_, rate_hz)) {}

  std::optional<RawFrame> next() override {
    if (stopped_ || index_ == images_.size()) return std::nullopt;
    RawFrame frame = read_image_file(images_[index_]);
    frame.index = static_cast<std::int64_t>(index_);
    frame.sequence = times_.numbers[index_];
    frame.time_s = times_.time_s(index_);
    if (!times_.unix_us.empty()) frame.unix_us = times_.unix_us[index_];
    ++index_;
    frame.arrived = std::chrono::steady_clock::now();
    return frame;
  }

  void stop() override { stopped_ = true; }
  double rate_hz() const override { return times_.rate_hz; }
  std::optional<std::int64_t> frame_count() const override {
    return static_cast<std::int64_t>(images_.size());
  }
  std::string description() const override {
    return fmt::format("folder {} of {} images, {:g} Hz{}", folder_.string(), images_.size(), times_.rate_hz,
                       times_.words());
  }
  std::string warning() const override { return times_.doubt; }
  std::int64_t lost_frames() const override {
    return index_ == 0 ? 0 : times_.numbers[index_ - 1] + 1 - static_cast<std::int64_t>(index_);
  }

 private:
  fs::path folder_;
  std::vector<fs::path> images_;
  FolderTimes times_;
  std::size_t index_ = 0;
  std::atomic<bool> stopped_ = false;
};

/// Throws Error where the names are those of several logs, or of one log in two formats: left_1.png and
/// right_1.png, 1.png and 1.jpg.
void refuse_mixture(const fs::path& folder, const std::vector<fs::path>& images) {
  std::set<std::string> stems;
  std::map<std::string, std::vector<std::string>> series;  // by the name without its digits
  for (const fs::path& image : images) {
    const std::string name = image.filename().string();
    std::string stem = image.stem().string();
    if (!stems.insert(stem).second)
      throw Error(folder.string() + ": holds " + name + " in another format, too; keep one of them");
    std::erase_if(stem, [](char c) { return c >= '0' && c <= '9'; });
    series[stem].push_back(name);
  }
  constexpr std::size_t kMostSensors = 4;  // more series are names of another kind
  if (series.size() < 2 || series.size() > kMostSensors) return;
  const auto few = [](const auto& names) { return names.second.size() < 2; };
  if (std::ranges::any_of(series, few)) return;
  throw Error(folder.string() + ": holds several series of pictures (" + series.begin()->second.front() +
              ", " + series.rbegin()->second.front() + "); give each a folder of its own");
}

}  // namespace

bool has_image_ending(const fs::path& path) {
  static constexpr std::array endings{".png", ".jpg", ".jpeg", ".bmp"};
  const std::string ending = lower_case(path.extension().string());
  return std::find(endings.begin(), endings.end(), ending) != endings.end();
}

std::vector<fs::path> list_images(const fs::path& folder) {
  std::vector<fs::path> images;
  std::error_code code;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code)) {
    const fs::path& path = entry->path();
    std::error_code not_a_file;
    const bool hidden = path.filename().string().starts_with(".");
    if (!hidden && path.stem() != "background" && has_image_ending(path) &&
        entry->is_regular_file(not_a_file))
      images.push_back(path);
  }
  if (code) throw Error(folder.string() + ": cannot be listed: " + code.message());
  std::sort(images.begin(), images.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return images;
}

std::unique_ptr<RawFrameSource> open_image_folder(const fs::path& folder, std::vector<fs::path> images,
                                                  const SensorProfile& profile) {
  refuse_mixture(folder, images);
  return std::make_unique<ImageFolderSource>(folder, std::move(images), profile.frame_rate_hz);
}

}  // namespace gelslam::detail
