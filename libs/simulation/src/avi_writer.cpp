#include "avi_writer.hpp"

#include <algorithm>
#include <cmath>
#include <string_view>

#include "gelslam/core/error.hpp"

namespace gelslam::simulation::detail {
namespace {

constexpr std::uint64_t largest_file = 1'000'000'000;
constexpr std::uint32_t rate_scale = 1000;
constexpr std::size_t header_list = 4 + 64 + 12 + 64 + 48;  // "hdrl", avih, LIST strl, strh, strf

/// Little-endian numbers and four-letter codes, in order.
class Bytes {
 public:
  Bytes& code(std::string_view four) {
    bytes_.insert(bytes_.end(), four.begin(), four.end());
    return *this;
  }
  Bytes& u32(std::uint64_t value) { return little(value, 4); }
  Bytes& u16(std::uint64_t value) { return little(value, 2); }
  Bytes& zeros(std::size_t count) {
    bytes_.insert(bytes_.end(), count, 0);
    return *this;
  }
  const std::vector<std::uint8_t>& get() const { return bytes_; }

 private:
  Bytes& little(std::uint64_t value, int count) {
    for (int k = 0; k < count; ++k) bytes_.push_back(static_cast<std::uint8_t>(value >> (8 * k)));
    return *this;
  }
  std::vector<std::uint8_t> bytes_;
};

std::uint64_t padded(std::uint32_t size) { return size + (size & 1u); }

}  // namespace

AviWriter::AviWriter(const std::filesystem::path& path, std::array<char, 4> codec, int width, int height,
                     double rate_hz)
    : file_(path),
      path_(path),
      stream_(file_.path(), std::ios::binary),
      codec_(codec),
      width_(width),
      height_(height),
      rate_hz_(rate_hz) {
  write_header();
}

void AviWriter::write(std::span<const std::uint8_t> bytes) {
  stream_.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  if (!stream_) throw Error("cannot write " + path_.string() + "; is the disk full?");
}

/// Called twice: to leave room, and with the final numbers.
void AviWriter::write_header() {
  const std::uint64_t frames = sizes_.size(), movie = 4 + picture_bytes_, index = 16 * frames;
  const std::string_view codec(codec_.data(), codec_.size());
  const std::uint32_t index_flag = 0x10;
  Bytes b;
  b.code("RIFF").u32(4 + 8 + header_list + 8 + movie + 8 + index).code("AVI ");
  b.code("LIST").u32(header_list).code("hdrl");
  b.code("avih")
      .u32(56)
      .u32(static_cast<std::uint64_t>(std::llround(1e6 / rate_hz_)))
      .u32(0)
      .u32(0)
      .u32(index_flag);
  b.u32(frames)
      .u32(0)
      .u32(1)
      .u32(largest_)
      .u32(static_cast<std::uint64_t>(width_))
      .u32(static_cast<std::uint64_t>(height_))
      .zeros(16);
  b.code("LIST").u32(4 + 64 + 48).code("strl");
  b.code("strh").u32(56).code("vids").code(codec).u32(0).u32(0).u32(0).u32(rate_scale);
  b.u32(static_cast<std::uint64_t>(std::llround(rate_hz_ * rate_scale)))
      .u32(0)
      .u32(frames)
      .u32(largest_)
      .u32(0xffffffff)
      .u32(0);
  b.u16(0).u16(0).u16(static_cast<std::uint64_t>(width_)).u16(static_cast<std::uint64_t>(height_));
  b.code("strf")
      .u32(40)
      .u32(40)
      .u32(static_cast<std::uint64_t>(width_))
      .u32(static_cast<std::uint64_t>(height_));
  b.u16(1)
      .u16(24)
      .code(codec)
      .u32(static_cast<std::uint64_t>(width_) * static_cast<std::uint64_t>(height_) * 3)
      .zeros(16);
  b.code("LIST").u32(movie).code("movi");
  write(b.get());
}

void AviWriter::add(std::span<const std::uint8_t> picture) {
  if (picture_bytes_ + picture.size() > largest_file)
    throw Error(path_.string() + " would be larger than 1 GB; make the scan shorter");
  const auto size = static_cast<std::uint32_t>(picture.size());
  write(Bytes().code("00dc").u32(size).get());
  write(picture);
  if (size % 2 != 0) write(Bytes().zeros(1).get());
  sizes_.push_back(size);
  picture_bytes_ += 8 + padded(size);
  largest_ = std::max(largest_, size);
}

void AviWriter::finish() {
  Bytes index;
  index.code("idx1").u32(16 * sizes_.size());
  std::uint64_t offset = 4;  // from the word "movi"
  for (const std::uint32_t size : sizes_) {
    constexpr std::uint32_t key_frame = 0x10;
    index.code("00dc").u32(key_frame).u32(offset).u32(size);
    offset += 8 + padded(size);
  }
  write(index.get());
  stream_.seekp(0);
  write_header();
  stream_.close();
  if (!stream_) throw Error("cannot write " + path_.string() + "; is the disk full?");
  file_.commit();
}

}  // namespace gelslam::simulation::detail
