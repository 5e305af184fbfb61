#pragma once

#include <cstddef>
#include <string>
#include <utility>
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
  std::string doubt;  ///< for people: why to look closely; empty when there is no reason
};

struct LabelCounts {
  std::size_t presses = 0, accepted = 0, left_out = 0;
  std::size_t doubtful = 0;  ///< of those that are still open
};

/// What a person decides about the circles of a press set: to accept, move or leave out each. Doubtful
/// presses come first. Labels that are there count as accepted, and as a person's.
class LabelSession {
 public:
  /// `found`: find_circle() of every press, in the set's order (else std::invalid_argument).
  LabelSession(PressSet set, std::vector<FoundCircle> found);

  const PressSet& set() const { return set_; }
  const std::vector<PressLabel>& labels() const { return labels_; }  ///< in the order they are shown
  std::size_t current() const { return current_; }                   ///< index into labels()
  const PressLabel& label() const { return labels_[current_]; }
  const CalibrationPress& press() const { return set_.presses[label().press]; }
  const FoundCircle& found() const { return found_[label().press]; }
  LabelCounts counts() const;
  std::string progress() const;  ///< "12 of 48 accepted, 3 doubtful"

  /// Another circle for the press shown, kept within sight; false when it is the same. `goes_on`: part of the
  /// movement that the last change began; undo() takes back all of it.
  bool put(const ContactCircle& circle, bool goes_on = false);
  void put_found();  ///< back to the circle found in the picture; nothing when there is none
  void accept();     ///< and on to the next open one
  void leave_out();  ///< the same
  /// Accepts all open ones, but for those in which no contact was found. Returns how many those are, and
  /// shows the first.
  std::size_t accept_rest();
  void show(std::size_t label);  ///< beyond the last one: the last
  void show_next();
  void show_previous();
  bool undo();  ///< takes back the last change; false when there is none

  std::size_t unsaved() const;  ///< presses that save() would write
  /// Writes what was decided to the set's folder: label.npz for accepted presses, left_out.npz in its place
  /// for those left out, and neither for those whose saved decision was taken back. Returns the number of
  /// presses written. When the disk does not take one the others are written all the same, and then it throws
  /// Error; the next save() tries again.
  std::size_t save();

 private:
  struct Change {
    std::size_t shown;
    std::vector<std::pair<std::size_t, PressLabel>> before;
  };

  void remember(std::vector<std::size_t> labels);
  void decide(LabelState state);
  bool show_next_open();
  bool is_saved(std::size_t label) const;
  void save_one(std::size_t label);

  PressSet set_;
  std::vector<FoundCircle> found_;
  std::vector<PressLabel> labels_, on_disk_;
  std::vector<Change> changes_;
  std::size_t current_ = 0;
};

/// Writes one press's decision into its folder, as LabelSession::save() does.
void write_decision(const std::filesystem::path& press_folder, const ContactCircle& circle, bool left_out);

}  // namespace gelslam
