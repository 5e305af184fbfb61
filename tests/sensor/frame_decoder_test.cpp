#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "gelslam/sensor/frame_source.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "raw_frames.hpp"

namespace gelslam::test {
namespace {

std::vector<std::uint8_t> encoded(const cv::Mat& picture, const std::string& ending) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(ending, picture, bytes, {cv::IMWRITE_JPEG_QUALITY, 90});
  return bytes;
}

RawFrame jpeg_of(const cv::Mat& picture) {
  return raw_frame(FrameEncoding::jpeg, encoded(picture, ".jpg"), picture.size());
}

double mean_difference(const cv::Mat3b& a, const cv::Mat3b& b) {
  return cv::norm(a, b, cv::NORM_L1) / (3.0 * static_cast<double>(a.total()));
}

cv::Mat3b decode_or_fail(FrameDecoder& decoder, const RawFrame& frame) {
  const auto image = decoder.decode(frame);
  EXPECT_TRUE(image.has_value()) << decoder.damage();
  return image ? image->bgr : cv::Mat3b();
}

/// A camera's raw image made of a calibrated one: enlarged so that it fills the whole, with a camera's
/// noise.
cv::Mat3b as_raw(const cv::Mat3b& picture, cv::Size raw) {
  cv::Mat3b large;
  cv::resize(picture, large, raw, 0, 0, cv::INTER_CUBIC);
  cv::Mat noise(raw, CV_16SC3);
  cv::theRNG().state = 5;
  cv::randn(noise, cv::Scalar::all(0), cv::Scalar::all(2.5));
  cv::add(large, noise, large, cv::noArray(), CV_8U);
  return large;
}

TEST(FrameDecoder, ScaledDecodingGivesTheFullyDecodedPicture) {
  for (const int number : {0, 7, 13}) {
    // 1/4, 1/2 and full scale, and sizes that no block of a JPEG divides.
    for (const cv::Size raw : {cv::Size(3280, 2464), cv::Size(1602, 1199), cv::Size(640, 480)}) {
      FrameDecoder decoder(mini_of(raw));
      const RawFrame frame = jpeg_of(as_raw(numbered_picture(number, 320, 240), raw));
      const cv::Mat3b expected =
          fit_to_profile(cv::imdecode(frame.bytes, cv::IMREAD_COLOR), mini_of(raw), "x");
      const cv::Mat3b got = decode_or_fail(decoder, frame);
      ASSERT_EQ(got.size(), expected.size());
      EXPECT_LT(mean_difference(got, expected), 0.5) << number << " " << raw;
      EXPECT_LT(std::abs(cv::mean(got)[0] - cv::mean(expected)[0]), 0.2) << "no shift of brightness";
    }
  }
}

/// Where the step of a line lies that is dark before and light after it: area averaging keeps the sum. The
/// levels are taken from the line's own ends, since JPEG rounds colors.
double edge_position(const cv::Mat1f& line) {
  const int total = static_cast<int>(line.total()), end = total / 8;
  const cv::Mat1f flat = line.reshape(1, 1);
  const double dark = cv::mean(flat.colRange(0, end))[0],
               light = cv::mean(flat.colRange(total - end, total))[0];
  double position = 0;
  for (const float value : flat) position += (light - value) / (light - dark);
  return position;
}

TEST(FrameDecoder, KeepsEveryEdgeInItsPlaceWhateverTheScaleAndShape) {
  for (const cv::Size raw : {cv::Size(3280, 2464), cv::Size(3001, 2250), cv::Size(1998, 1499),
                             cv::Size(641, 479), cv::Size(1400, 980), cv::Size(1000, 1000)}) {
    FrameDecoder decoder(mini_of(raw));
    // The middle five sevenths of one side, less of the other, in square pixels.
    const double scale = 320 / (5.0 / 7 * std::min<double>(raw.width, raw.height * 4.0 / 3));
    const double tolerance = 0.1 + scale;  // whole raw pixels are kept
    for (const double part : {0.35, 0.5, 0.65}) {
      const cv::Point edge(cvRound(raw.width * part), cvRound(raw.height * part));
      cv::Mat3b picture(raw, cv::Vec3b(40, 50, 60));
      cv::Mat right = picture.colRange(edge.x, raw.width), below = picture.rowRange(edge.y, raw.height);
      right += cv::Scalar(100, 0, 0);
      below += cv::Scalar(0, 0, 100);
      cv::Mat channels[3];
      cv::Mat1f row, column;
      cv::split(decode_or_fail(decoder, jpeg_of(picture)), channels);
      cv::reduce(channels[0], row, 0, cv::REDUCE_AVG, CV_32F);
      cv::reduce(channels[2], column, 1, cv::REDUCE_AVG, CV_32F);
      EXPECT_NEAR(edge_position(row), 160 + scale * (edge.x - 0.5 * raw.width), tolerance)
          << raw << " " << part;
      EXPECT_NEAR(edge_position(column), 120 + scale * (edge.y - 0.5 * raw.height), tolerance)
          << raw << " " << part;
    }
  }
}

TEST(FrameDecoder, LosslessEncodingsAreExact) {
  FrameDecoder decoder(mini_of({1404, 1053}));
  const cv::Mat3b exact = numbered_picture(4, 320, 240), raw = numbered_picture(4, 1404, 1053);
  EXPECT_EQ(cv::norm(decode_or_fail(decoder, bgr_frame(exact)), exact), 0);
  EXPECT_EQ(
      cv::norm(decode_or_fail(decoder, raw_frame(FrameEncoding::png, encoded(exact, ".png"), exact.size())),
               exact),
      0);
  // The resize of another library: the same up to rounding.
  const cv::Mat3b expected = fit_to_profile(raw, mini_of(raw.size()), "x");
  const cv::Mat3b from_bgr = decode_or_fail(decoder, bgr_frame(raw));
  const cv::Mat3b from_png =
      decode_or_fail(decoder, raw_frame(FrameEncoding::png, encoded(raw, ".png"), raw.size()));
  EXPECT_LE(cv::norm(from_bgr, expected, cv::NORM_INF), 1.0);
  EXPECT_LT(mean_difference(from_bgr, expected), 0.05);
  EXPECT_EQ(cv::norm(from_bgr, from_png), 0);
}

TEST(FrameDecoder, YuyvHasTheColorsOfBt601) {
  // Written from the standard's figures (ITU-R BT.601, 8 bits), not by a library: yellow, green, red, blue.
  struct Color {
    std::uint8_t y, u, v;
    cv::Vec3b bgr;
  };
  FrameDecoder decoder(mini_of({640, 480}));
  for (const Color& color : {Color{210, 16, 146, {0, 255, 255}}, Color{145, 54, 34, {0, 255, 0}},
                             Color{81, 90, 240, {0, 0, 255}}, Color{41, 240, 110, {255, 0, 0}}}) {
    std::vector<std::uint8_t> bytes;
    for (int i = 0; i < 640 * 480 / 2; ++i) bytes.insert(bytes.end(), {color.y, color.u, color.y, color.v});
    const cv::Mat3b got = decode_or_fail(decoder, raw_frame(FrameEncoding::yuyv, bytes, cv::Size(640, 480)));
    for (int k = 0; k < 3; ++k) EXPECT_NEAR(got(120, 160)[k], color.bgr[k], 3);
  }
}

class Damage : public testing::Test {
 protected:
  std::string of(const RawFrame& frame) {
    EXPECT_FALSE(decoder.decode(frame).has_value());
    return decoder.damage();
  }
  FrameDecoder decoder{mini_of({1280, 960})};
  RawFrame good = jpeg_of(numbered_picture(2, 1280, 960));
};

TEST_F(Damage, BytesAfterTheJpegAreIgnored) {
  const cv::Mat3b clean = decode_or_fail(decoder, good);
  for (const int padding : {0x00, 0xff, 0xd8, 0x41}) {
    RawFrame padded = good;
    padded.bytes.insert(padded.bytes.end(), 5000, static_cast<std::uint8_t>(padding));
    EXPECT_EQ(cv::norm(decode_or_fail(decoder, padded), clean), 0);
  }
  RawFrame stuffed = good;  // zeros between the last line and the end mark, as some cameras send
  stuffed.bytes.insert(stuffed.bytes.end() - 2, 300, 0);
  EXPECT_EQ(cv::norm(decode_or_fail(decoder, stuffed), clean), 0);
}

TEST_F(Damage, EveryTruncationIsSaid) {
  for (std::size_t length = 1; length < good.bytes.size(); length += good.bytes.size() / 40 + 1) {
    RawFrame cut = good;
    cut.bytes.resize(length);
    EXPECT_THAT(of(cut), testing::AnyOf(HasSubstr("JPEG ends early"), HasSubstr("no JPEG"))) << length;
  }
  RawFrame no_end = good;
  no_end.bytes.resize(no_end.bytes.size() - 40);
  EXPECT_EQ(of(no_end), "JPEG ends early");
  EXPECT_TRUE(decoder.decode(good).has_value()) << "the next good frame is read again";
  EXPECT_EQ(decoder.damage(), "");
}

TEST_F(Damage, AMissingEndMarkIsNone) {
  const cv::Mat3b whole = decode_or_fail(decoder, good);
  RawFrame cut = good;
  for (const int padding : {0, 300}) {
    cut.bytes.resize(good.bytes.size() - 2);
    cut.bytes.resize(cut.bytes.size() + static_cast<std::size_t>(padding));
    EXPECT_EQ(cv::norm(decode_or_fail(decoder, cut), whole), 0) << padding;
  }
  cut.bytes.resize(good.bytes.size() - 4);
  EXPECT_EQ(of(cut), "JPEG ends early") << "a piece of the last line is missing";
  cv::imencode(".jpg", numbered_picture(2, 1280, 960), cut.bytes, {cv::IMWRITE_JPEG_PROGRESSIVE, 1});
  cut.bytes.resize(cut.bytes.size() - 2);
  EXPECT_EQ(of(cut), "JPEG ends early") << "detail may be missing";
}

TEST_F(Damage, WhatIsNoPictureIsSaid) {
  RawFrame frame = good;
  frame.bytes.clear();
  EXPECT_EQ(of(frame), "the frame is empty");
  frame.bytes.assign(1000, 0);
  EXPECT_EQ(of(frame), "the bytes are no JPEG");
  frame = good;
  frame.width_px = 3280;
  frame.height_px = 2464;
  EXPECT_EQ(of(frame), "the picture says it is 1280x960 pixels, announced were 3280x2464");
  frame =
      raw_frame(FrameEncoding::jpeg, encoded(cv::Mat1b(960, 1280, uchar{90}), ".jpg"), cv::Size(1280, 960));
  EXPECT_THAT(of(frame), HasSubstr("a gray picture"));
  EXPECT_EQ(of(raw_frame(FrameEncoding::bgr, std::vector<std::uint8_t>(100), cv::Size(320, 240))),
            "the picture ends early: 100 of 230400 bytes");
  EXPECT_THAT(
      of(raw_frame(FrameEncoding::yuyv, std::vector<std::uint8_t>(100), cv::Size(2000000000, 2000000000))),
      HasSubstr("pixels are more than any touch sensor has"));
  EXPECT_THAT(of(raw_frame(FrameEncoding::bgr, std::vector<std::uint8_t>(100), cv::Size(-4, 3))),
              HasSubstr("pixels are more than any touch sensor has"));
}

TEST_F(Damage, GoodAndDamagedPicturesAreCounted) {
  EXPECT_EQ(decoder.warning(), "");
  RawFrame torn = good, lost = good;
  torn.bytes.resize(torn.bytes.size() / 2);
  lost.bytes.clear();
  lost.damage = "the disk gave up";
  lost.name = "x.avi, frame 8";
  for (const RawFrame& frame : {good, lost, torn, good}) decoder.decode(frame);
  EXPECT_EQ(decoder.good(), 2);
  EXPECT_EQ(decoder.left_out(), 2);
  EXPECT_EQ(decoder.warning(), "left out 2 damaged pictures (the first: x.avi, frame 8: the disk gave up)");
}

}  // namespace
}  // namespace gelslam::test
