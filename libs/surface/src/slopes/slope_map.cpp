#include "gelslam/surface/slope_map.hpp"

#include "gelslam/core/error.hpp"
#include "slopes/gradient_map.hpp"

namespace gelslam {

using namespace surface::detail;

SlopeMap read_slope_map(const GradientModel& model, const cv::Mat3b& bgr, const cv::Mat3b& background) {
  if (bgr.size() != background.size()) throw Error("image and background differ in size");
  SlopeMap map;
  GradientMap(model, background)
      .compute(bgr, color_table(Light{}), cv::Mat1b(bgr.size(), static_cast<unsigned char>(255)), map.gx,
               map.gy);
  return map;
}

}  // namespace gelslam
