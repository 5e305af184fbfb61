#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <string>

#include "../support/temporary_folder.hpp"
#include "cameras/v4l2_camera.hpp"
#include "fake_camera.hpp"

namespace gelslam::test {

/// A camera whose driver is simulated.
class Camera : public testing::Test {
 protected:
  Camera() {
    options.timeout_s = 0.05;
    options.patience_s = 0.12;
    options.settle_s = 0.02;
  }
  /// Whatever happened, nothing stays open, mapped or streaming.
  void TearDown() override {
    EXPECT_EQ(mini.open_count, 0);
    EXPECT_EQ(mini.mapped_count, 0);
    EXPECT_FALSE(mini.streaming);
  }

  std::unique_ptr<CameraSource> open() { return open_camera(options, system); }
  std::string open_error() {
    return message_of([&] { open(); });
  }
  /// Opens, reads until the camera is lost, and gives the words for it.
  std::string reading_error() {
    return message_of([&] {
      const auto camera = open();
      while (camera->next()) {
      }
    });
  }
  void send(std::uint32_t sequence, double time_s) {
    FakeFrame frame;
    frame.sequence = sequence;
    frame.time_s = time_s;
    mini.frames.push_back(frame);
  }
  std::ptrdiff_t first_call(unsigned long request) const {
    return std::find(mini.calls.begin(), mini.calls.end(), request) - mini.calls.begin();
  }

  FakeCamera mini;
  detail::VideoSystem system = fake_system({&mini});
  CameraOptions options;
};

}  // namespace gelslam::test
