#include <gtest/gtest.h>
#include <zlib.h>

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <random>

#include "../support/temporary_folder.hpp"
#include "gelslam/core/crc32.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/image/codecs.hpp"

namespace gelslam {
namespace {

using test::TemporaryFolder;

std::span<const std::uint8_t> span_of(const std::string& bytes) {
  return {reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size()};
}

std::string big_endian(std::size_t value) {
  std::string bytes;
  for (const int shift : {24, 16, 8, 0}) bytes += static_cast<char>(value >> shift & 255);
  return bytes;
}

std::string chunk(const std::string& type, const std::string& content) {
  return big_endian(content.size()) + type + content + big_endian(crc32_of(type + content));
}

std::string compressed(const std::string& bytes) {
  uLongf size = compressBound(bytes.size());
  std::string result(size, '\0');
  compress(reinterpret_cast<Bytef*>(result.data()), &size, reinterpret_cast<const Bytef*>(bytes.data()),
           bytes.size());
  return result.substr(0, size);
}

std::string noise(std::size_t size, std::uint32_t seed = 1) {
  std::minstd_rand random(seed);
  std::string bytes(size, '\0');
  for (char& byte : bytes) byte = static_cast<char>(random() >> 8);
  return bytes;
}

/// A PNG of any kind, without the help of libpng: rows of noise. `extra`: chunks in front of the pixels.
struct PngKind {
  std::size_t bit_depth, color_type;
  std::string extra;
  std::size_t missing_rows = 0;

  std::string bytes(std::size_t width = 37, std::size_t height = 11) const {
    const std::size_t samples = color_type == 2 ? 3 : color_type == 6 ? 4 : color_type == 4 ? 2 : 1;
    const std::size_t row = (width * samples * bit_depth + 7) / 8;
    std::string rows;
    for (std::size_t v = missing_rows; v < height; ++v)
      rows += std::string(1, '\0') + noise(row, static_cast<std::uint32_t>(v + 1));
    const std::string header = big_endian(width) + big_endian(height) + static_cast<char>(bit_depth) +
                               static_cast<char>(color_type) + std::string(3, '\0');
    return "\x89PNG\r\n\x1a\n" + chunk("IHDR", header) + extra + chunk("IDAT", compressed(rows)) +
           chunk("IEND", "");
  }
};

cv::Mat opencv_decoded(const std::string& bytes) {
  const std::vector<uchar> copy(bytes.begin(), bytes.end());
  return cv::imdecode(copy, cv::IMREAD_UNCHANGED);
}

void expect_same(const cv::Mat& found, const cv::Mat& expected, const std::string& what) {
  ASSERT_EQ(found.size(), expected.size()) << what;
  ASSERT_EQ(found.type(), expected.type()) << what;
  EXPECT_EQ(cv::norm(found, expected, cv::NORM_INF), 0.0) << what;
}

const std::string kGamma = chunk("gAMA", big_endian(100000));
std::string palette(std::size_t colors) { return chunk("PLTE", noise(3 * colors, 99)); }

TEST(DecodePng, ValuesAreThoseThatOpenCVReads) {
  const std::vector<PngKind> kinds = {
      {8, 2, ""},
      {8, 6, ""},
      {8, 2, kGamma},
      {8, 6, kGamma},
      {8, 2, chunk("sRGB", std::string(1, '\1'))},
      {8, 2, chunk("tRNS", std::string("\0\7\0\7\0\7", 6))},
      {8, 2, chunk("sBIT", "\5\6\5")},
      {8, 3, palette(256)},
      {4, 3, palette(16)},
      {2, 3, palette(4)},
      {1, 3, palette(2)},
      {8, 3, kGamma + palette(256) + chunk("tRNS", noise(200))},
  };
  for (std::size_t i = 0; i < kinds.size(); ++i) {
    const std::string bytes = kinds[i].bytes();
    cv::Mat expected = opencv_decoded(bytes);
    if (expected.type() == CV_8UC4) cv::cvtColor(expected, expected, cv::COLOR_BGRA2BGR);
    const PngInfo info = check_png(span_of(bytes));
    EXPECT_EQ(info.damage, "");
    EXPECT_TRUE(info.color);
    EXPECT_EQ(info.bits_per_channel, static_cast<int>(kinds[i].bit_depth));
    expect_same(decode_png(span_of(bytes)), expected, "kind " + std::to_string(i));
  }
}

TEST(DecodePng, DamageBehindRightChecksumsIsFoundAndSilent) {
  testing::internal::CaptureStderr();
  EXPECT_TRUE(decode_png(span_of(PngKind{8, 2, "", 1}.bytes())).empty()) << "a row is missing";
  EXPECT_TRUE(decode_png(span_of(PngKind{8, 3, ""}.bytes())).empty()) << "no palette";
  EXPECT_TRUE(decode_png(span_of(PngKind{8, 2, chunk("XxXx", "?")}.bytes())).empty())
      << "unknown and critical";
  EXPECT_TRUE(decode_png(span_of(PngKind{7, 2, ""}.bytes())).empty());
  EXPECT_TRUE(decode_png(span_of(PngKind{8, 2, ""}.bytes(1, 0))).empty());
  // Noise in every chunk, with its checksum put right: any picture or none, of the size in the header.
  std::minstd_rand random(7);
  const std::string good = PngKind{8, 3, palette(256)}.bytes();
  for (int i = 0; i < 2000; ++i) {
    std::string bytes = good;
    for (int flips = 0; flips < 3; ++flips)
      bytes[8 + random() % (bytes.size() - 8)] = static_cast<char>(random());
    for (std::size_t at = 8; at + 12 <= bytes.size();) {
      std::size_t length = 0;
      for (std::size_t k = 0; k < 4; ++k) length = length << 8 | static_cast<unsigned char>(bytes[at + k]);
      if (length > bytes.size() - at - 12) break;
      bytes.replace(at + 8 + length, 4,
                    big_endian(crc32_of(std::string_view(bytes).substr(at + 4, 4 + length))));
      at += 12 + length;
    }
    const PngInfo info = check_png(span_of(bytes));
    if (!info.damage.empty() || info.width_px * info.height_px > 1'000'000) continue;
    const cv::Mat3b picture = decode_png(span_of(bytes));
    if (!picture.empty()) {
      EXPECT_EQ(picture.cols, info.width_px);
      EXPECT_EQ(picture.rows, info.height_px);
    }
  }
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

cv::Mat random_picture(int type, cv::Size size) {
  cv::Mat picture(size, type);
  cv::theRNG().state = 3;
  cv::randu(picture, 0, 256);
  return picture;
}

TEST(EncodePng, OpenCVReadsWhatWasWritten) {
  TemporaryFolder folder;
  for (const int type : {CV_8UC1, CV_8UC3}) {
    for (const cv::Size size : {cv::Size(320, 240), cv::Size(1, 1), cv::Size(33, 7)}) {
      const cv::Mat picture = random_picture(type, size);
      write_png(folder / "a.png", picture);
      expect_same(cv::imread((folder / "a.png").string(), cv::IMREAD_UNCHANGED), picture, "whole");
      const cv::Mat part = random_picture(type, size + cv::Size(5, 5))(cv::Rect({3, 2}, size));
      write_png(folder / "a.png", part);
      expect_same(cv::imread((folder / "a.png").string(), cv::IMREAD_UNCHANGED), part,
                  "a part of a larger one");
    }
  }
  EXPECT_THROW(write_png(folder / "none" / "a.png", random_picture(CV_8UC3, {4, 4})), Error);
}

TEST(ReadJpegHeader, SaysWhatIsNoUprightColorPicture) {
  const auto jpeg_of = [](const cv::Mat& picture) {
    std::vector<uchar> bytes;
    cv::imencode(".jpg", picture, bytes);
    return std::string(bytes.begin(), bytes.end());
  };
  const auto unfit = [](const std::string& bytes) { return JpegDecoder().read_header(span_of(bytes)).unfit; };
  const std::string color = jpeg_of(cv::Mat3b(48, 64, cv::Vec3b(90, 120, 30)));
  EXPECT_EQ(unfit(color), "");
  EXPECT_EQ(unfit(jpeg_of(cv::Mat1b(48, 64, uchar{90}))), kGrayPicture);
  const auto with_exif = [&](const std::string& tiff) {
    const std::string content = std::string("Exif\0\0", 6) + tiff;
    return color.substr(0, 2) + "\xff\xe1" + big_endian(content.size() + 2).substr(2) + content +
           color.substr(2);
  };
  const std::string little("II*\0\10\0\0\0\1\0\22\1\3\0\1\0\0\0\6\0\0\0\0\0\0\0", 26),
      big("MM\0*\0\0\0\10\0\1\1\22\0\3\0\0\0\1\0\3\0\0\0\0\0\0", 26);
  EXPECT_NE(unfit(with_exif(little)).find("orientation 6"), std::string::npos);
  EXPECT_NE(unfit(with_exif(big)).find("orientation 3"), std::string::npos);
  EXPECT_EQ(unfit(with_exif(little.substr(0, 18) + '\1' + little.substr(19))), "") << "upright";
  for (std::size_t length = 0; length < little.size(); ++length)
    EXPECT_NO_THROW(unfit(with_exif(little.substr(0, length)))) << "EXIF data that break off";
  // The headers of a picture with four inks are enough: size, components, begin of the lines.
  const std::string cmyk(
      "\xff\xd8\xff\xc0\0\x14\x8\0\x30\0\x40\4\1\x11\0\2\x11\0\3\x11\0\4\x11\0"
      "\xff\xda\0\xe\4\1\0\2\0\3\0\4\0\0\x3f\0\1\xff\xd9",
      43);
  EXPECT_NE(unfit(cmyk).find("CMYK"), std::string::npos);
}

}  // namespace
}  // namespace gelslam
