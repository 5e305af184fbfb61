// Writes pictures as a GelSight Mini's camera would send them, as JPEG: raw_frames OUT FRAMES [VIDEO]
// Without a video: a made-up gel picture of the camera's full size. With one (320x240, as logs are): its
// frames at half their size with a border that the crop takes away, which an emulated machine can follow.
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

namespace {

const cv::Size kRaw(3280, 2464);
const cv::Rect kWindow(468, 353, 2344, 1758);          // what remains of it after the crop
const cv::Size kSmallRaw(224, 168), kSmall(160, 120);  // before and after the crop
const cv::Point kSmallBorder(32, 24);

cv::Mat3b made_up_picture(int index) {
  cv::Mat3b picture(240, 320);
  for (int v = 0; v < picture.rows; ++v) {
    for (int u = 0; u < picture.cols; ++u)
      picture(v, u) =
          cv::Vec3b(cv::saturate_cast<uchar>(80 + u / 4), 110, cv::saturate_cast<uchar>(150 - v / 4));
  }
  cv::circle(picture, {100 + 4 * index, 120}, 30, {60, 90, 190}, cv::FILLED, cv::LINE_AA);
  return picture;
}

cv::Mat3b with_border(const cv::Mat3b& picture, cv::Size size, cv::Point place) {
  cv::Mat3b whole;
  cv::copyMakeBorder(picture, whole, place.y, size.height - place.y - picture.rows, place.x,
                     size.width - place.x - picture.cols, cv::BORDER_REPLICATE);
  return whole;
}

cv::Mat3b as_raw(const cv::Mat3b& picture) {
  cv::Mat3b inner;
  cv::resize(picture, inner, kWindow.size(), 0, 0, cv::INTER_CUBIC);
  return with_border(inner, kRaw, kWindow.tl());
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 3) return 2;
  cv::VideoCapture video;
  if (argc > 3 && !video.open(argv[3])) {
    std::cerr << "raw_frames: cannot read " << argv[3] << std::endl;
    return 1;
  }
  for (int i = 0; i < std::stoi(argv[2]); ++i) {
    cv::Mat picture;
    if (argc > 3 && !video.read(picture)) break;
    if (argc > 3) cv::resize(picture, picture, kSmall, 0, 0, cv::INTER_AREA);
    picture = argc > 3 ? with_border(picture, kSmallRaw, kSmallBorder) : as_raw(made_up_picture(i));
    char name[16];
    std::snprintf(name, sizeof(name), "%05d.jpg", i);
    if (!cv::imwrite((std::filesystem::path(argv[1]) / name).string(), picture,
                     {cv::IMWRITE_JPEG_QUALITY, 92}))
      return 1;
  }
}
