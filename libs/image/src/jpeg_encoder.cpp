#include <turbojpeg.h>

#include <memory>

#include "gelslam/core/error.hpp"
#include "gelslam/image/encoders.hpp"

namespace gelslam {

std::vector<std::uint8_t> encode_jpeg(const cv::Mat3b& bgr) {
  constexpr int quality = 95;
  const std::unique_ptr<void, int (*)(tjhandle)> encoder(tjInitCompress(), tjDestroy);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  const bool good = encoder != nullptr &&
                    tjCompress2(encoder.get(), bgr.data, bgr.cols, static_cast<int>(bgr.step[0]), bgr.rows,
                                TJPF_BGR, &bytes, &size, TJSAMP_444, quality, TJFLAG_ACCURATEDCT) == 0;
  const std::unique_ptr<unsigned char, void (*)(unsigned char*)> owner(bytes, tjFree);
  if (!good) throw Error("cannot encode a picture as JPEG");
  return {bytes, bytes + size};
}

}  // namespace gelslam
