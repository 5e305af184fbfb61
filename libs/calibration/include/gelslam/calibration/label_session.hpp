#pragma once

#include <cstddef>
#include <string>
#include <vector>

#include "gelslam/calibration/circle_finder.hpp"
#include "gelslam/calibration/press_set.hpp"

namespace gelslam {

enum class LabelState { open, accepted, left_out };
enum class LabelOrigin { found, from_file, by_hand };

/// One press as a person decides about it.
struct PressLabel {
  std::size_t press = 0;  ///< index into the set
  ContactCircle circle;
  LabelState state = LabelState::open;
  LabelOrigin origin = LabelOrigin::found;
  std::string warning;   ///< for people: why to look closely; empty when there is no reason
  bool is_saved = true;  ///< the press's folder holds this circle and state
};

struct LabelCounts {
  std::size_t presses = 0, accepted = 0, left_out = 0;
  std::size_t doubtful = 0;  ///< of those that are still open
  std::size_t open() const { return presses - accepted - left_out; }
};

/// What a person decides about the circles of a press set: to accept, move or leave out each. Doubtful
/// presses come first. Labels that are there count as accepted, and as a person's.
class LabelSession {
 public:
  /// `found`: find_circle() of every press, in the set's order. Without a press,
  /// as before the first one is collected, nothing that speaks of the press shown may be called.
  LabelSession(PressSet set, std::vector<FoundCircle> found);

  /// A press that was collected meanwhile, already in the set's folder with `found` as its label. It comes
  /// last. `background`: of the set, if it had none.
  void add(CalibrationPress press, const FoundCircle& found, const cv::Mat3b& background);

  const PressSet& set() const { return set_; }
  const std::vector<PressLabel>& labels() const { return labels_; }  ///< in the order they are shown
  std::size_t current() const { return current_; }                   ///< index into labels()
  const PressLabel& label() const { return labels_[current_]; }
  const CalibrationPress& press() const { return set_.presses[label().press]; }
  const FoundCircle& found() const { return found_[label().press]; }
  LabelCounts counts() const;
  std::string progress() const;  ///< "12 of 48 accepted, 3 doubtful"
  /// The contacts of a ball's presses, but for those that are left out or not clear.
  std::vector<ContactCircle> contacts(double diameter_mm) const;

  void put(const ContactCircle& circle);  ///< another circle for the press shown, kept within sight
  /// And on to the next open one, or, where none is open, to the one beside it; false then.
  bool accept();
  bool leave_out();  ///< the same
  /// Accepts all open ones, but for those in which no contact was found, or whose picture or label cannot be
  /// read. Returns how many those are, and shows the first.
  std::size_t accept_rest();
  void show(std::size_t label);  ///< beyond the last one: the last

  std::size_t unsaved() const;  ///< presses that save() would write
  /// Writes what was decided to the set's folder: label.npz for accepted presses, left_out.npz in its place
  /// for those left out. When the disk does not take one the others are written all the same, and then it
  /// throws Error; the next save() tries again.
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
