#include "gelslam/loop_closure/self_similarity.hpp"

#include <algorithm>
#include <cmath>

#include "gelslam/registration/texture_spectrum.hpp"

namespace gelslam {
namespace {

// Patterns that matter are many pixels wide, and a quarter of the pixels is enough.
constexpr int kShrink = 2;
constexpr double kLeastShiftMm = 1.0;
constexpr double kLeastShared = 0.5;

}  // namespace

double self_similarity(const Surface& surface) {
  if (surface.contact_pixels == 0) return 0.0;
  const CoarseTexture texture(surface, kShrink);
  if (texture.pixels < 1) return 0.0;
  const TextureSpectrum spectrum(texture);
  const auto [similarity, shared] = spectrum.laid_on(spectrum);
  const double least_shift_px = kLeastShiftMm / texture.pixel_pitch_mm;
  double largest = 0.0;
  for (int y = 0; y < similarity.rows; ++y)
    for (int x = 0; x < similarity.cols; ++x) {
      const double sx = std::min(x, similarity.cols - x), sy = std::min(y, similarity.rows - y);
      if (std::hypot(sx, sy) >= least_shift_px && shared(y, x) >= kLeastShared * texture.pixels)
        largest = std::max(largest, static_cast<double>(similarity(y, x)));
    }
  return largest;
}

}  // namespace gelslam
