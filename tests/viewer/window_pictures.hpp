#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <opencv2/core.hpp>
#include <set>
#include <string>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/viewer/controls.hpp"
#include "gelslam/viewer/ui.hpp"
#include "gelslam/viewer/window_host.hpp"
#include "gl/gl_context.hpp"

// What is to be seen in pictures of the window.
namespace gelslam::test {

using viewer::Box;
using viewer::Color;

inline bool can_draw() {
  try {
    viewer::detail::GlContext::offscreen();
    return true;
  } catch (const Error&) {
    return false;
  }
}

inline cv::Vec3d bgr(Color color) {
  return {static_cast<double>(color >> 16U & 0xFFU), static_cast<double>(color >> 8U & 0xFFU),
          static_cast<double>(color >> 0U & 0xFFU)};
}

/// No key means two things.
template <class Rows>
void expect_keys_of_one_meaning(const Rows& rows) {
  std::set<int> codes;
  for (const auto& row : rows)
    for (const int code : row.keys) EXPECT_TRUE(codes.insert(code).second) << code;
}

/// The words that a window shows.
template <class Window>
std::vector<std::string> words_of(const Window& window) {
  std::vector<std::string> words;
  for (const auto& text : window.texts()) words.push_back(text.text);
  return words;
}

/// With GELSLAM_PICTURES=FOLDER pictures are kept to be looked at.
inline cv::Mat3b kept(const cv::Mat3b& picture, const std::string& name) {
  if (const char* folder = std::getenv("GELSLAM_PICTURES"))
    viewer::write_png(std::string(folder) + "/" + name + ".png", picture);
  return picture;
}

/// The pixels in `box`.
inline cv::Mat3b within(const cv::Mat3b& picture, const Box& box) {
  const cv::Rect rect(cvFloor(box.x), cvFloor(box.y), cvCeil(box.width), cvCeil(box.height));
  return picture(rect & cv::Rect({0, 0}, picture.size())).clone();
}

/// Share of pixels in `box` that are within 60 gray levels of `color`.
inline double share_of(const cv::Mat3b& picture, const Box& box, Color color) {
  const cv::Mat3b pixels = within(picture, box);
  const auto hits = std::count_if(pixels.begin(), pixels.end(), [&](const cv::Vec3b& pixel) {
    return cv::norm(cv::Vec3d(pixel) - bgr(color)) < 60;
  });
  return pixels.empty() ? 0 : static_cast<double>(hits) / static_cast<double>(pixels.total());
}

/// How much of `box` the letters of a text cover: where its pixels lie, on average, between what is behind
/// the text (the median: letters cover less than half) and `color`.
inline double ink_in(const cv::Mat3b& picture, const Box& box, Color color) {
  const cv::Mat3b cut = within(picture, box);
  if (cut.empty()) return 0;
  cv::Vec3d behind;
  for (int i = 0; i < 3; ++i) {
    cv::Mat1b values;
    cv::extractChannel(cut, values, i);
    cv::sort(values.reshape(1, 1), values, cv::SORT_EVERY_ROW);
    behind[i] = values(static_cast<int>(values.total() / 2));
  }
  const cv::Vec3d span = bgr(color) - behind;
  double sum = 0;
  for (const cv::Vec3b& pixel : cut)
    sum += std::clamp((cv::Vec3d(pixel) - behind).dot(span) / span.dot(span), 0.0, 1.0);
  return sum / static_cast<double>(cut.total());
}

/// Share of the view's pixels, below the words, that differ between two pictures.
inline double change(const cv::Mat3b& a, const cv::Mat3b& b, const Box& view) {
  const cv::Rect rect(0, 100, static_cast<int>(view.width), static_cast<int>(view.height) - 100);
  cv::Mat difference;
  cv::absdiff(a(rect), b(rect), difference);
  cv::transform(difference, difference, cv::Matx13f(1, 1, 1));
  return static_cast<double>(cv::countNonZero(difference > 24)) / rect.area();
}

/// Pixels that glow, below the words: much red, less green, little blue.
inline int glowing(const cv::Mat3b& picture, const Box& view) {
  const cv::Mat3b pixels = within(picture, {0, 100, view.width, view.height - 100});
  return static_cast<int>(std::count_if(pixels.begin(), pixels.end(), [](const cv::Vec3b& p) {
    return p[2] > 130 && p[2] - p[0] > 70 && p[2] > p[1];
  }));
}

}  // namespace gelslam::test
