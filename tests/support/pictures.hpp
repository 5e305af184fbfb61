#pragma once

#include <filesystem>
#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>
#include <opencv2/videoio.hpp>
#include <stdexcept>

namespace gelslam::test {

/// A picture with colors as a gel has them, whose mean brightness in the middle encodes `number` (0..15), so
/// that a test sees which frame it got even after compression.
inline cv::Mat3b numbered_picture(int number, int width, int height) {
  cv::Mat3b image(height, width);
  for (int v = 0; v < height; ++v) {
    for (int u = 0; u < width; ++u) {
      image(v, u) = cv::Vec3b(cv::saturate_cast<uchar>(200 * u / width), 90,
                              cv::saturate_cast<uchar>(200 * v / height));
    }
  }
  const cv::Rect middle(width / 4, height / 4, width / 2, height / 2);
  image(middle).setTo(cv::Scalar(10 + 15 * number, 40, 220));
  return image;
}

inline int number_in(const cv::Mat3b& image) {
  const cv::Rect middle(3 * image.cols / 8, 3 * image.rows / 8, image.cols / 4, image.rows / 4);
  return cvRound((cv::mean(image(middle))[0] - 10.0) / 15.0);
}

inline void write_video(const std::filesystem::path& path, const char* codec, int frames, int width,
                        int height, double rate_hz = 25.0, bool gray = false) {
  cv::VideoWriter writer(path.string(), cv::CAP_FFMPEG,
                         cv::VideoWriter::fourcc(codec[0], codec[1], codec[2], codec[3]), rate_hz,
                         cv::Size(width, height));
  if (!writer.isOpened()) throw std::runtime_error("cannot write " + path.string());
  for (int i = 0; i < frames; ++i) {
    cv::Mat image = numbered_picture(i % 16, width, height);
    if (gray) {
      cv::cvtColor(image, image, cv::COLOR_BGR2GRAY);
      cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
    }
    writer.write(image);
  }
}

}  // namespace gelslam::test
