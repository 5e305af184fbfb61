// Writes pictures as a GelSight Mini's camera would send them, as JPEG: raw_frames OUT FRAMES [VIDEO]
// Without a video: a made-up gel picture. With one (320x240, as logs are): its frames, enlarged so that the
// crop gives them back.
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>

namespace {

const cv::Size raw(3280, 2464);
const cv::Rect window(468, 353, 2344, 1758);  // what remains of it after the crop

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

cv::Mat3b as_raw(const cv::Mat3b& picture) {
  cv::Mat3b inner, whole;
  cv::resize(picture, inner, window.size(), 0, 0, cv::INTER_CUBIC);
  cv::copyMakeBorder(inner, whole, window.y, raw.height - window.br().y, window.x, raw.width - window.br().x,
                     cv::BORDER_REPLICATE);
  return whole;
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
    if (argc <= 3) picture = made_up_picture(i);
    char name[16];
    std::snprintf(name, sizeof(name), "%05d.jpg", i);
    if (!cv::imwrite((std::filesystem::path(argv[1]) / name).string(), as_raw(picture),
                     {cv::IMWRITE_JPEG_QUALITY, 92}))
      return 1;
  }
}
