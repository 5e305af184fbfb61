#include "disturbed_log.hpp"

#include <gtest/gtest.h>

#include <memory>
#include <string>

namespace gelslam::lab {
namespace {

/// Ten pictures of one color.
class PlainLog : public RawFrameSource {
 public:
  static constexpr int kFrames = 10, kSide = 64, kBlue = 100, kGreen = 110, kRed = 120;

  std::optional<RawFrame> next() override {
    if (next_ == kFrames) return std::nullopt;
    RawFrame frame;
    frame.encoding = FrameEncoding::bgr;
    for (int i = 0; i < kSide * kSide; ++i)
      for (const int level : {kBlue, kGreen, kRed}) frame.bytes.push_back(static_cast<unsigned char>(level));
    frame.width_px = frame.height_px = kSide;
    frame.index = frame.sequence = next_++;
    return frame;
  }
  void stop() override {}
  double rate_hz() const override { return 25; }
  std::string description() const override { return "plain"; }

 private:
  int next_ = 0;
};

TEST(DisturbedLog, LeavesTheBackgroundAlone) {
  constexpr int kBackground = 4;
  const RawFrame plain = *PlainLog().next();
  for (const Disturbance& disturbance : disturbances()) {
    SensorProfile profile;
    profile.width_px = profile.height_px = PlainLog::kSide;
    DisturbedLog log(std::make_unique<FrameSource>(std::make_shared<PlainLog>(), "plain", profile),
                     kBackground, PlainLog::kFrames - kBackground, disturbance);
    int changed = 0;
    for (int frame = 0; frame < PlainLog::kFrames; ++frame) {
      const std::optional<RawFrame> raw = log.next();
      ASSERT_TRUE(raw) << disturbance.name;
      EXPECT_EQ(raw->index, frame);
      const bool is_plain = raw->bytes == plain.bytes;
      if (frame < kBackground) {
        EXPECT_TRUE(is_plain) << disturbance.name;
      }
      changed += is_plain ? 0 : 1;
      if (std::string(disturbance.name) == "20 % darker than the background" && frame >= kBackground) {
        EXPECT_EQ(raw->bytes.front(), 80);
      }
    }
    // A defocused picture of one color stays as it is.
    EXPECT_EQ(changed > 0, std::string(disturbance.name) != "defocus of 1.5 pixels") << disturbance.name;
    EXPECT_FALSE(log.next());
  }
}

}  // namespace
}  // namespace gelslam::lab
