#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <map>
#include <set>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "images/sources.hpp"

namespace gelslam::detail {
namespace {

namespace fs = std::filesystem;

class ImageFolderSource final : public RawFrameSource {
 public:
  ImageFolderSource(fs::path folder, std::vector<fs::path> images, double rate_hz)
      : folder_(std::move(folder)), images_(std::move(images)), rate_hz_(rate_hz) {}

  std::optional<RawFrame> next() override {
    if (stopped_ || index_ == images_.size()) return std::nullopt;
    RawFrame frame = read(images_[index_]);
    frame.name = images_[index_].string();
    frame.index = frame.sequence = static_cast<std::int64_t>(index_++);
    frame.time_s = static_cast<double>(frame.index) / rate_hz_;
    frame.arrived = std::chrono::steady_clock::now();
    return frame;
  }

  void stop() override { stopped_ = true; }
  double rate_hz() const override { return rate_hz_; }
  std::optional<std::int64_t> frame_count() const override {
    return static_cast<std::int64_t>(images_.size());
  }
  std::string description() const override {
    return fmt::format("folder {} of {} images, {:g} Hz", folder_.string(), images_.size(), rate_hz_);
  }

 private:
  static RawFrame read(const fs::path& path) {
    try {
      return read_image_file(path);
    } catch (const Error& error) {
      RawFrame frame;
      frame.damage = error.what();
      const std::string said_anyway = path.string() + ": ";
      if (frame.damage.starts_with(said_anyway)) frame.damage.erase(0, said_anyway.size());
      return frame;
    }
  }

  fs::path folder_;
  std::vector<fs::path> images_;
  double rate_hz_;
  std::size_t index_ = 0;
  std::atomic<bool> stopped_ = false;
};

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
        entry->is_regular_file(not_a_file)) {
      images.push_back(path);
    }
  }
  if (code) throw Error(folder.string() + ": cannot be listed: " + code.message());
  std::sort(images.begin(), images.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return images;
}

namespace {

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

std::unique_ptr<RawFrameSource> open_image_folder(const fs::path& folder, std::vector<fs::path> images,
                                                  const SensorProfile& profile) {
  refuse_mixture(folder, images);
  return std::make_unique<ImageFolderSource>(folder, std::move(images), profile.frame_rate_hz);
}

}  // namespace gelslam::detail
