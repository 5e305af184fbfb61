#include "readable_background.hpp"

#include "gelslam/core/error.hpp"
#include "gelslam/surface/background_judgement.hpp"
#include "gelslam/surface/marker_dots.hpp"

namespace gelslam {

void require_readable_background(const cv::Mat3b& background, const std::string& device_name,
                                 const std::string& name,
                                 const std::function<void(const std::string&)>& say_doubt) {
  if (const auto markers = find_marker_dots(background)) throw Error(name + ": " + markers->sentence());
  const std::string lamps = judge_lamps(background, device_name);
  if (!lamps.empty())
    throw Error(name + ": " + lamps +
                " (presses and background must be taken again, the right way; another sensor than a " +
                device_name + "? name it with --config)");
  for (const std::string& doubt : judge_background(background, device_name)) say_doubt(name + ": " + doubt);
}

}  // namespace gelslam
