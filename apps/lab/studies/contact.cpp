// Study: agreement of the contact detected in images with the true one of simulated scans.

#include <algorithm>
#include <filesystem>
#include <memory>
#include <numeric>
#include <opencv2/imgcodecs.hpp>
#include <vector>

#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/simulation/data_folder.hpp"
#include "gelslam/slam/surface_stream.hpp"
#include "study.hpp"

namespace gelslam::lab {
namespace {

namespace fs = std::filesystem;

struct ContactArguments {
  std::vector<fs::path> folders;
  fs::path model, out;
};

cv::Mat1b true_contact(const fs::path& folder, const TactileImage& image, cv::Size size) {
  const fs::path file = contact_file(folder, image.index);
  cv::Mat1b contact = cv::imread(file.string(), cv::IMREAD_GRAYSCALE);
  if (contact.size() != size)
    throw Error(file.string() + ": no contact of the log's size; simulate the scan anew");
  return contact;
}

/// Numbers of pixels in one image.
struct Overlap {
  int touched = 0, read = 0, both = 0;

  static double share(int part, int of) { return of > 0 ? static_cast<double>(part) / of : 0; }
  double of_union() const { return share(both, touched + read - both); }
  double missed() const { return 1 - share(both, touched); }
  double not_touched() const { return share(read - both, read); }
};

/// Compares where the image shows the gel. The true contact is given along z, while the camera sees it in
/// perspective.
Overlap compare(const Surface& surface, const cv::Mat1b& truth) {
  const CameraModel camera = surface.camera();
  const CameraModel along_z{camera.size, camera.pitch_mm};
  Overlap overlap;
  for (int v = 0; v < camera.size.height; ++v)
    for (int u = 0; u < camera.size.width; ++u) {
      const auto raw = camera.raw_px({u, v});
      const auto pixel = along_z.pixel_at(surface.point_mm({u, v}));
      if (!raw || !camera.pixel_of(*raw) || !pixel) continue;
      const bool is_touched = truth(*pixel) != 0, is_read = surface.contact(v, u) != 0;
      overlap.touched += is_touched ? 1 : 0;
      overlap.read += is_read ? 1 : 0;
      overlap.both += is_touched && is_read ? 1 : 0;
    }
  return overlap;
}

double mean(const std::vector<double>& values) {
  return std::reduce(values.begin(), values.end()) /
         static_cast<double>(std::max<std::size_t>(1, values.size()));
}

/// Measures one scan in the way `reconstruct` reads it.
Json measure(const fs::path& folder, const fs::path& model) {
  const LogInput input{.log = folder, .model = model};
  StageTimer timer;
  SurfaceStream stream(input, resolve_config(input), timer);
  std::vector<double> of_union, missed, not_touched, beside_px;
  while (const std::optional<SurfaceStream::Item> item = stream.next()) {
    if (!item->surface) continue;
    const Surface& surface = *item->surface;
    const Overlap overlap = compare(surface, true_contact(folder, item->image, surface.contact.size()));
    if (overlap.touched == 0) {
      beside_px.push_back(overlap.read);
      continue;
    }
    of_union.push_back(overlap.of_union());
    missed.push_back(overlap.missed());
    not_touched.push_back(overlap.not_touched());
  }
  return {{"scan", folder.string()},
          {"touched_frames", of_union.size()},
          {"iou", mean(of_union)},
          {"iou_p5", quantile(of_union, 0.05)},
          {"missed", mean(missed)},
          {"not_touched", mean(not_touched)},
          {"untouched_frames", beside_px.size()},
          {"contact_px_there", mean(beside_px)}};
}

void run(const ContactArguments& arguments) {
  StudyCases cases(arguments.folders.size());
  Json rows = Json::array();
  for (const fs::path& folder : arguments.folders) {
    cases.begin(folder.string());
    rows.push_back(measure(folder, arguments.model));
    write_study(arguments.out, "contact", rows);
  }
  print_csv(rows);
}

}  // namespace

void add_contact(CLI::App& lab) {
  const auto arguments = std::make_shared<ContactArguments>();
  CLI::App* command =
      add_study(lab, "contact", "Compare the contact that is read from simulated scans with the true one",
                arguments, run);
  command->add_option("DATA", arguments->folders, "Data folders of gelslam simulate scan")->required();
  command->add_option("--model", arguments->model, "Gradient model (default: the one the folder names)");
  command->add_option("-o,--output", arguments->out, "Folder for contact.json");
  command->footer("Example: gelslam-lab contact pebble coin");
}

}  // namespace gelslam::lab
