#include "gelslam/sensor/frame_source.hpp"

#include <array>
#include <fstream>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/sensor/raw_log.hpp"
#include "images/left_out.hpp"
#include "images/sources.hpp"

namespace gelslam::detail {

void LeftOut::leave_out(const std::string& damage) {
  constexpr int patience = 10;
  if (left_out_++ == 0) first_ = damage;
  if (used_ == 0 && left_out_ == patience) throw Error(first_);
}

void LeftOut::require_some(const std::string& what) const {
  if (used_ > 0) return;
  throw Error(left_out_ > 0 ? first_ : what + " holds no readable frame");
}

std::string LeftOut::warning() const {
  if (left_out_ == 0) return "";
  return "left out " + counted(left_out_, "damaged picture") + " (the first: " + first_ + ")";
}

}  // namespace gelslam::detail

namespace gelslam {

namespace fs = std::filesystem;

bool is_matroska(const fs::path& file) {
  std::error_code code;
  if (!fs::is_regular_file(file, code)) return false;
  std::array<char, 4> head{};
  std::ifstream(file, std::ios::binary).read(head.data(), head.size());
  return head == std::array<char, 4>{'\x1a', '\x45', '\xdf', '\xa3'};
}

std::unique_ptr<FrameSource> open_frame_source(const fs::path& log, const SensorProfile& profile) {
  std::error_code code;
  const fs::file_status status = fs::status(log, code);
  if (!fs::exists(status)) throw Error(log.string() + ": no such file or folder");
  if (fs::is_directory(status)) {
    const fs::path recorded = log / "log.mkv";
    if (fs::exists(recorded, code)) return open_frame_source(recorded, profile);
    const fs::path video = log / "gelsight.avi";
    if (fs::exists(video, code)) return detail::open_video(video, profile);
    std::vector<fs::path> images = detail::list_images(log);
    if (images.empty())
      throw Error(log.string() +
                  ": the folder holds neither log.mkv nor gelsight.avi nor images (png, jpg, bmp, tiff)");
    return detail::open_image_folder(log, std::move(images), profile);
  }
  if (!fs::is_regular_file(status)) throw Error(log.string() + ": neither a file nor a folder");
  if (detail::has_image_ending(log))
    throw Error(log.string() + ": a single image; give the folder that holds the images, or a video");
  if (is_matroska(log)) {
    if (auto source = detail::open_matroska_frames(log, profile)) return source;
  }
  return detail::open_video(log, profile);
}

}  // namespace gelslam
