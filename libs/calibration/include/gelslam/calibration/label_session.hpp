#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gelslam/calibration/circle_finder.hpp"
#include "gelslam/calibration/press_set.hpp"

namespace gelslam {

enum class LabelState { open, accepted, left_out };
enum class LabelOrigin { found, from_file, by_hand };

/// A press and what the user has decided about it.
struct PressLabel {
  std::size_t press = 0;  ///< index into the set
  ContactCircle circle;
  LabelState state = LabelState::open;
  LabelOrigin origin = LabelOrigin::found;
  std::string warning;   ///< Sentence for the user why to look closely; or empty.
  bool is_saved = true;  ///< True if the press's folder contains this circle and state.
};

struct LabelCounts {
  std::size_t presses = 0, accepted = 0, left_out = 0;
  std::size_t doubtful = 0;  ///< Open presses with a warning.
  std::size_t open() const { return presses - accepted - left_out; }
};

/// The user's decisions about the circles of a press set: to accept, move or leave out each. Doubtful presses
/// come first. Labels that already exist count as accepted by the user.
class LabelSession {
 public:
  /// `found` is the result of find_circle() for every press, in the set's order. While there are no presses,
  /// functions about the current press must not be called.
  LabelSession(PressSet set, std::vector<FoundCircle> found);

  /// Adds a press that was collected in the meantime and is already in the set's folder, with `found` as its
  /// label. It becomes the last one. `background` is that of the set, in case it had none.
  void add(CalibrationPress press, const FoundCircle& found, const cv::Mat3b& background);

  const PressSet& set() const { return set_; }
  /// In the order in which they are shown.
  const std::vector<PressLabel>& labels() const { return labels_; }
  std::size_t current() const { return current_; }  ///< index into labels()
  const PressLabel& label() const { return labels_[current_]; }
  const CalibrationPress& press() const { return set_.presses[label().press]; }
  const FoundCircle& found() const { return found_[label().press]; }
  LabelCounts counts() const;
  std::string progress() const;  ///< "12 of 48 accepted, 3 doubtful"
  /// Returns the contact circles of a ball's presses, except of those that are left out or doubtful.
  std::vector<ContactCircle> contacts(double diameter_mm) const;

  /// Changes the circle of the current press, limited to the visible image.
  void put(const ContactCircle& circle);
  /// Accepts the current press and moves on to the next open one. If none is open, it moves to the
  /// neighboring one and returns false.
  bool accept();
  bool leave_out();  ///< Leaves the current press out and moves on as accept().
  /// Accepts all open presses, except those in which no contact was found or whose image or label cannot be
  /// read. Returns the number of these exceptions and shows the first of them.
  std::size_t accept_rest();
  void show(std::size_t label);  ///< Shows a press; an index beyond the end shows the last one.

  std::size_t unsaved() const;  ///< Returns the number of presses that save() would write.
  /// Writes all decisions to the set's folder: label.npz for accepted presses, and left_out.npz instead of it
  /// for those left out. If a file cannot be written, the others are still written, and Error is thrown at
  /// the end; the next save() tries again.
  void save();

 private:
  PressLabel first_label(std::size_t press) const;
  bool has_contact(const PressLabel& label) const;
  bool decide(LabelState state);
  bool show_next_open();

  PressSet set_;
  std::vector<FoundCircle> found_;
  std::vector<PressLabel> labels_;
  std::size_t current_ = 0;
};

}  // namespace gelslam
