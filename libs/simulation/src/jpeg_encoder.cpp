#include "jpeg_encoder.hpp"

#include <jpeglib.h>  // needs cstdio before it

#include <csetjmp>
#include <cstddef>
#include <cstdio>
#include <cstdlib>

#include "gelslam/core/error.hpp"

namespace gelslam::simulation::detail {
namespace {

struct ErrorExit {
  jpeg_error_mgr base;
  std::jmp_buf jump;
};

void leave(j_common_ptr info) { std::longjmp(reinterpret_cast<ErrorExit*>(info->err)->jump, 1); }

/// Plain C inside: an error jumps out, and no destructor may be in its way. `bytes` is malloc'ed, also on
/// failure.
bool compress(const std::uint8_t* bgr, std::size_t stride, int width, int height, int quality,
              unsigned char** bytes, unsigned long* size) {
  jpeg_compress_struct info{};
  ErrorExit error{};
  info.err = jpeg_std_error(&error.base);
  error.base.error_exit = leave;
  if (setjmp(error.jump) != 0) {
    jpeg_destroy_compress(&info);
    return false;
  }
  jpeg_create_compress(&info);
  jpeg_mem_dest(&info, bytes, size);
  info.image_width = static_cast<JDIMENSION>(width);
  info.image_height = static_cast<JDIMENSION>(height);
  info.input_components = 3;
  info.in_color_space = JCS_EXT_BGR;
  jpeg_set_defaults(&info);
  jpeg_set_quality(&info, quality, TRUE);
  info.comp_info[0].h_samp_factor = info.comp_info[0].v_samp_factor = 1;
  jpeg_start_compress(&info, TRUE);
  while (info.next_scanline < info.image_height) {
    auto* row = const_cast<JSAMPROW>(bgr + info.next_scanline * stride);  // the C interface lacks a const
    jpeg_write_scanlines(&info, &row, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  return true;
}

}  // namespace

std::vector<std::uint8_t> encode_jpeg(const cv::Mat3b& bgr, int quality) {
  if (bgr.empty()) throw Error("cannot encode an empty picture");
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool good = compress(bgr.data, bgr.step[0], bgr.cols, bgr.rows, quality, &bytes, &size);
  std::vector<std::uint8_t> result;
  if (good) result.assign(bytes, bytes + size);
  std::free(bytes);
  if (!good) throw Error("cannot encode a simulated picture");
  return result;
}

}  // namespace gelslam::simulation::detail
