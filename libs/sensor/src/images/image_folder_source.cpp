#include <fmt/core.h>

#include <algorithm>
#include <array>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "images/left_out.hpp"
#include "images/sources.hpp"

namespace gelslam::detail {
namespace {

namespace fs = std::filesystem;

class ImageFolderSource final : public FrameSource {
 public:
  ImageFolderSource(fs::path folder, std::vector<fs::path> images, const SensorProfile& profile)
      : folder_(std::move(folder)), images_(std::move(images)), profile_(profile) {}

  std::optional<TactileImage> next() override {
    while (index_ < images_.size()) {
      const fs::path& path = images_[index_];
      TactileImage image;
      image.index = static_cast<std::int64_t>(index_++);
      image.time_s = static_cast<double>(image.index) / profile_.frame_rate_hz;
      const cv::Mat3b picture = read(path);
      if (picture.empty()) continue;
      image.bgr = fit_to_profile(picture, profile_, path.string());
      pictures_.use();
      return image;
    }
    pictures_.require_some(folder_.string() + ": the folder");
    return std::nullopt;
  }

  std::optional<std::int64_t> frame_count() const override {
    return static_cast<std::int64_t>(images_.size());
  }
  double rate_hz() const override { return profile_.frame_rate_hz; }

  std::string description() const override {
    return fmt::format("folder {} of {} images, {:g} Hz", folder_.string(), images_.size(), rate_hz());
  }

  std::string warning() const override { return pictures_.warning(); }

 private:
  /// Empty when it is damaged.
  cv::Mat3b read(const fs::path& path) {
    try {
      return read_image(path);
    } catch (const Error& error) {
      pictures_.leave_out(error.what());
      return {};
    }
  }

  fs::path folder_;
  std::vector<fs::path> images_;
  SensorProfile profile_;
  std::size_t index_ = 0;
  LeftOut pictures_;
};

}  // namespace

bool has_image_ending(const fs::path& path) {
  static constexpr std::array endings{".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff"};
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

std::unique_ptr<FrameSource> open_image_folder(const fs::path& folder, std::vector<fs::path> images,
                                               const SensorProfile& profile) {
  return std::make_unique<ImageFolderSource>(folder, std::move(images), profile);
}

}  // namespace gelslam::detail
