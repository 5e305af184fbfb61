#include <algorithm>
#include <cmath>
#include <opencv2/imgproc.hpp>

#include "gelslam/core/index.hpp"
#include "gelslam/surface/slopes.hpp"
#include "registration_quality.hpp"

namespace gelslam {

namespace registration::detail {
namespace {

// In a cell of 16 patches of noise, unrelated textures have a CCS of 0 +- 0.25; all cells of a part together
// less.
const double kUnrelatedCcs = std::sqrt(kNoisePatchPx) / kCellPx, kDoubtfulCcs = 2 * kUnrelatedCcs;
constexpr int kLeastSamples = 10;  // numerics: of a cell

bool is_below(double ccs, const CurvatureProducts& of) {
  return of.dot < ccs * std::sqrt(of.reference2 * of.target2);
}

/// A cell with enough texture, in which the two differ. Where curvature is one and a half times that of
/// noise, more than half of what is read is the object's, and CCS is above 0.5 where the texture is the same.
bool is_doubtful(const CurvatureProducts& cell, double noise_rad) {
  const double telling = 1.5 * noise_rad;
  return cell.samples >= kLeastSamples &&
         std::min(cell.reference2, cell.target2) >= cell.samples * telling * telling &&
         is_below(kDoubtfulCcs, cell);
}

}  // namespace

ApartSamples find_apart(const NormalFlowReference::Impl& reference, const Surface& target,
                        const Residuals& residuals, const Pose& target_T_reference, double noise_rad) {
  const PixelLookup lookup(reference.samples, target, target_T_reference);
  const int columns = target.contact.cols / kCellPx + 1, rows = target.contact.rows / kCellPx + 1;
  std::vector<CurvatureProducts> cells(index(columns * rows));
  const auto cell_of = [&](cv::Point at) { return at.y / kCellPx * columns + at.x / kCellPx; };
  int shared = 0;
  for (std::size_t k = 0; k < residuals.weight.size(); ++k) {
    if (residuals.weight[k] <= 0) continue;
    const cv::Point at = lookup.pixel(lookup.warped_mm(k));
    if (!is_read(target, at)) continue;
    cells[index(cell_of(at))].add(products_of(reference.curvature[k], target.curvature(at)));
    ++shared;
  }
  cv::Mat1b doubtful(rows, columns);
  std::transform(cells.begin(), cells.end(), doubtful.begin(), [&](const CurvatureProducts& cell) {
    return static_cast<std::uint8_t>(is_doubtful(cell, noise_rad));
  });
  cv::Mat1i part_of;
  std::vector<CurvatureProducts> parts(index(cv::connectedComponents(doubtful, part_of, 4)));
  for (int i = 0; i < columns * rows; ++i) parts[index(part_of(i))].add(cells[index(i)]);

  ApartSamples apart;
  for (int i = 0; i < columns * rows; ++i) {
    const CurvatureProducts& part = parts[index(part_of(i))];
    if (!doubtful(i) || part.samples <= kMostContradicted * shared || !is_below(kUnrelatedCcs, part))
      continue;
    apart.cells.push_back({i % columns, i / columns});
    apart.share += static_cast<double>(cells[index(i)].samples) / shared;
    doubtful(i) = 2;
  }
  if (apart.cells.empty()) return apart;
  apart.is_apart.resize(residuals.weight.size());
  for (std::size_t k = 0; k < residuals.weight.size(); ++k)
    apart.is_apart[k] = doubtful(cell_of(lookup.pixel(lookup.warped_mm(k)))) == 2;
  return apart;
}

}  // namespace registration::detail

Surface without_cells(Surface surface, const std::vector<PictureCell>& cells) {
  const cv::Rect picture({}, surface.contact.size());
  surface.contact = surface.contact.clone();
  surface.confidence = surface.confidence.clone();
  surface.curvature = surface.curvature.clone();
  for (const PictureCell& cell : cells) {
    const cv::Rect square = cv::Rect(cell.column * kCellPx, cell.row * kCellPx, kCellPx, kCellPx) & picture;
    surface.contact(square) = 0;
    surface.curvature(square) = 0;
    if (!surface.confidence.empty()) surface.confidence(square) = 0;
  }
  surface.contact_pixels = cv::countNonZero(surface.contact);
  return surface;
}

}  // namespace gelslam
