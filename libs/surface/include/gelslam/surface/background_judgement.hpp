#pragma once

#include <opencv2/core/mat.hpp>
#include <string>
#include <vector>

#include "gelslam/core/gradient_model.hpp"

namespace gelslam {

/// What about a picture of the bare gel (mean_image of a few frames) makes one doubt the sensor, as sentences
/// for people (own): too dark, saturated, without color, markers, dirt or a tear, and for a GelSight Mini,
/// whose lamps make the top bluish and the bottom reddish, red and blue swapped or the picture upside down.
/// With `model` also a bare gel that the model reads as sloped: another sensor's model, another gel, another
/// exposure. A picture mirrored left to right cannot be told from a right one. Contact is check_background's
/// business. The limits lie well apart from four real sensors' backgrounds.
std::vector<std::string> judge_background(const cv::Mat3b& mean, const std::string& device_name,
                                          const GradientModel* model = nullptr);

/// Its part about the lamps alone: colors that do not lie as this sensor's lamps lay them, red and blue
/// swapped, the picture upside down; "" when they do, or for a sensor whose lamps are not known. Throws Error
/// when the picture is smaller than 32 pixels.
std::string judge_lamps(const cv::Mat3b& mean, const std::string& device_name);

}  // namespace gelslam
