#include <cmath>

#include "gelslam/core/target_clones.hpp"
#include "shape_makers.hpp"

namespace gelslam::simulation::detail {
namespace {

float fade(float t) { return t * t * t * (t * (t * 6.0F - 15.0F) + 10.0F); }

/// Returns the weighted sum of the gradients of the eight corners of the lattice cell at (ix, iy, iz), for
/// the point (x, y, z) inside it. Without branches and over all corners at once, so that the compiler
/// vectorizes it: most of the time for a textured object is spent here.
GELSLAM_TARGET_CLONES("avx2", "default")
float blend_corners(std::int32_t ix, std::int32_t iy, std::int32_t iz, float x, float y, float z, float fx,
                    float fy, float fz, std::uint32_t seed) {
  constexpr std::uint32_t across = 0x8da6b343u, along = 0xd8163841u, up = 0xcb1ab31fu;
  const std::uint32_t key_x = static_cast<std::uint32_t>(ix) * across,
                      key_y = static_cast<std::uint32_t>(iy) * along,
                      key_z = static_cast<std::uint32_t>(iz) * up;
  alignas(32) float term[8];
  for (std::uint32_t k = 0; k < 8; ++k) {
    const std::uint32_t kx = k & 1, ky = (k >> 1) & 1, kz = (k >> 2) & 1;
    std::uint32_t key = seed ^ (key_x + kx * across) ^ (key_y + ky * along) ^ (key_z + kz * up);
    key ^= key >> 15;
    key *= 0x2c1b3c6du;
    key ^= key >> 12;
    key *= 0x297a2d39u;
    key ^= key >> 15;
    const float dx = x - static_cast<float>(kx), dy = y - static_cast<float>(ky),
                dz = z - static_cast<float>(kz);
    // Dot product with one of the twelve edge directions of a cube.
    const std::uint32_t h = key & 15u;
    const float a = h < 8 ? dx : dy;
    const float b = h < 4 ? dy : (((h == 12) | (h == 14)) ? dx : dz);
    const float dot = ((h & 1u) != 0 ? -a : a) + ((h & 2u) != 0 ? -b : b);
    const float wx = kx != 0 ? fx : 1.0F - fx, wy = ky != 0 ? fy : 1.0F - fy, wz = kz != 0 ? fz : 1.0F - fz;
    term[k] = wx * wy * wz * dot;
  }
  return ((term[0] + term[1]) + (term[2] + term[3])) + ((term[4] + term[5]) + (term[6] + term[7]));
}

}  // namespace

float gradient_noise(const Eigen::Vector3f& point, std::uint32_t seed) {
  const float bx = std::floor(point.x()), by = std::floor(point.y()), bz = std::floor(point.z());
  const float x = point.x() - bx, y = point.y() - by, z = point.z() - bz;
  return blend_corners(static_cast<std::int32_t>(bx), static_cast<std::int32_t>(by),
                       static_cast<std::int32_t>(bz), x, y, z, fade(x), fade(y), fade(z), seed);
}

}  // namespace gelslam::simulation::detail
