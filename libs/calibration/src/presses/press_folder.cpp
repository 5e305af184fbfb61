#include "gelslam/calibration/press_folder.hpp"

#include <fmt/core.h>

#include <system_error>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/image/codecs.hpp"
#include "gelslam/sensor/image_input.hpp"
#include "gelslam/surface/background_drift.hpp"
#include "gelslam/surface/model_file.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

constexpr int kMaxPressesOfABall = 100'000;  // The search for a free name ends here.
constexpr const char* kCatalogHeader = "experiment_reldir,diameter(mm)\n";

void make_folders(const fs::path& path) {
  std::error_code failure;
  fs::create_directories(path, failure);
  if (failure) throw Error("cannot make the folder " + quoted(path) + ": " + failure.message());
}

std::string read_catalog_text(const fs::path& path) {
  if (!fs::is_regular_file(path)) return kCatalogHeader;
  std::string text = read_file(path);
  if (text.empty()) return kCatalogHeader;
  if (text.back() != '\n') text += '\n';
  return text;
}

/// Creates the first folder <n>/ that does not exist yet. Creating a folder is atomic, so two programs never
/// get the same one.
std::string free_name(const fs::path& folder, double diameter_mm) {
  const std::string ball = fmt::format("{:.3f}mm", diameter_mm);
  make_folders(folder / ball);
  for (int number = 0; number < kMaxPressesOfABall; ++number) {
    const std::string name = ball + "/" + std::to_string(number);
    std::error_code failure;
    if (fs::create_directory(folder / name, failure)) return name;
    if (failure && failure != std::errc::file_exists)
      throw Error("cannot make the folder " + quoted(folder / name) + ": " + failure.message());
  }
  throw Error(quoted(folder / ball) + " is full");
}

}  // namespace

PressFolder::PressFolder(const fs::path& folder, double diameter_mm)
    : folder_(folder), diameter_mm_(diameter_mm) {
  if (folder.empty()) throw Error("give the folder for the presses a name");
  earlier_.folder = folder;
  if (!fs::exists(folder)) return;
  if (!fs::is_directory(folder)) throw Error(quoted(folder) + " is a file; name a folder for the presses");
  lock_ = FolderLock(folder);
  if (fs::exists(folder / "catalog.csv")) {
    earlier_ = read_press_set(folder);
  } else if (fs::exists(folder / "background.png")) {
    earlier_.background = read_image(folder / "background.png");
  } else if (!fs::is_empty(folder)) {
    throw Error(quoted(folder) +
                " holds something else than presses; name a new folder, or one of an earlier collect");
  }
}

void PressFolder::write_background(const cv::Mat3b& background) {
  if (!earlier_.background.empty()) return;
  make_folders(folder_);
  FolderLock lock = lock_.holds() ? std::move(lock_) : FolderLock(folder_);
  // Neither file existed when this program started.
  if (fs::exists(folder_ / "background.png") || fs::exists(folder_ / "catalog.csv"))
    throw Error("meanwhile another program has collected into " + quoted(folder_) + ": begin again");
  write_png(folder_ / "background.png", background);
  lock_ = std::move(lock);
  earlier_.background = background.clone();
}

void PressFolder::require_same_gel(const cv::Mat3b& now) const {
  const cv::Mat3b& then = earlier_.background;
  if (then.empty()) return;
  if (now.size() != then.size())
    throw Error(quoted(folder_) + " holds pictures of " + size_text(then.cols, then.rows) +
                ", the sensor now gives " + size_text(now.cols, now.rows) +
                ": another sensor needs a folder of its own");
  const BackgroundDrift drift = measure_drift(background_cells(then), background_cells(now));
  if (drift.gel_changed)
    throw Error(quoted(folder_) + " holds presses of another gel, or in a light that cannot be followed (" +
                fmt::format("{:.1f} gray levels off", drift.gel_change_levels) + "); begin a new folder");
}

std::string PressFolder::add(const CollectedPress& press) {
  if (earlier_.presses.size() + added_ >= kMaxPresses)
    throw Error(quoted(folder_) + " holds " + std::to_string(kMaxPresses) +
                " presses, and more cannot be read: begin another folder");
  std::string name = free_name(folder_, diameter_mm_);
  try {
    write_png(folder_ / name / "gelsight.png", press.bgr);
    write_label(folder_ / name / kLabelFile, press.circle);
    write_file_atomically(folder_ / "catalog.csv", read_catalog_text(folder_ / "catalog.csv") + name + "," +
                                                       fmt::format("{}", diameter_mm_) + "\n");
  } catch (const Error&) {
    std::error_code ignored;
    fs::remove_all(folder_ / name, ignored);  // Created above by this program.
    throw;
  }
  ++added_;
  return name;
}

}  // namespace gelslam
