#include <linux/videodev2.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <optional>

#include "cameras/v4l2_camera.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam::detail {
namespace {

constexpr int kMaxControls = 256;  // The list of a faulty driver may be endless.

/// An automatic control, the value that turns it off, and the controls that it changes while it is on.
struct Automatic {
  std::uint32_t id;
  std::int32_t off;
  std::array<std::uint32_t, 2> moves;
};
constexpr std::array<Automatic, 7> kAutomatics{{
    {V4L2_CID_EXPOSURE_AUTO, V4L2_EXPOSURE_MANUAL, {V4L2_CID_EXPOSURE_ABSOLUTE, V4L2_CID_EXPOSURE}},
    {V4L2_CID_EXPOSURE_AUTO_PRIORITY, 0, {0, 0}},  // It may lower the frame rate for a longer exposure.
    {V4L2_CID_AUTO_WHITE_BALANCE, 0, {V4L2_CID_WHITE_BALANCE_TEMPERATURE, 0}},
    {V4L2_CID_AUTOGAIN, 0, {V4L2_CID_GAIN, 0}},
    {V4L2_CID_FOCUS_AUTO, 0, {V4L2_CID_FOCUS_ABSOLUTE, 0}},
    {V4L2_CID_HUE_AUTO, 0, {V4L2_CID_HUE, 0}},
    {V4L2_CID_AUTOBRIGHTNESS, 0, {V4L2_CID_BRIGHTNESS, 0}},
}};

struct Control {
  std::uint32_t id = 0;
  std::string name;
  std::int32_t minimum = 0, maximum = 0;
};

/// Converts "Exposure Time, Absolute" to "exposure_time_absolute", as v4l2-ctl does.
std::string control_name(const std::string& title) {
  std::string name;
  for (const char c : title) {
    const bool letter = (c >= '0' && c <= '9') || (c >= 'a' && c <= 'z');
    if (letter)
      name += c;
    else if (c >= 'A' && c <= 'Z')
      name += static_cast<char>(c - 'A' + 'a');
    else if (!name.empty() && name.back() != '_')
      name += '_';
  }
  return name.substr(0, name.find_last_not_of('_') + 1);
}

std::vector<Control> controls_of(const VideoNode& node) {
  std::vector<Control> controls;
  v4l2_queryctrl query{};
  for (int i = 0; i < kMaxControls; ++i) {
    query.id |= V4L2_CTRL_FLAG_NEXT_CTRL;
    if (node.call(VIDIOC_QUERYCTRL, &query) != 0) break;
    const bool number = query.type == V4L2_CTRL_TYPE_INTEGER || query.type == V4L2_CTRL_TYPE_BOOLEAN ||
                        query.type == V4L2_CTRL_TYPE_MENU || query.type == V4L2_CTRL_TYPE_INTEGER_MENU;
    if (!number || (query.flags & (V4L2_CTRL_FLAG_DISABLED | V4L2_CTRL_FLAG_WRITE_ONLY)) != 0) continue;
    controls.push_back({query.id, control_name(driver_text(query.name)), query.minimum, query.maximum});
  }
  return controls;
}

std::optional<std::int32_t> value_of(const VideoNode& node, std::uint32_t id) {
  v4l2_control control{};
  control.id = id;
  if (node.call(VIDIOC_G_CTRL, &control) != 0) return std::nullopt;
  return control.value;
}

int set_value(const VideoNode& node, std::uint32_t id, std::int32_t value) {
  v4l2_control control{};
  control.id = id;
  control.value = value;
  return node.call(VIDIOC_S_CTRL, &control);
}

bool is_on(const VideoNode& node, const Automatic& automatic) {
  const auto value = value_of(node, automatic.id);
  return value && *value != automatic.off;
}

bool is_moved(const VideoNode& node, std::uint32_t id) {
  return std::ranges::any_of(kAutomatics, [&](const Automatic& automatic) {
    const bool concerned = automatic.id == id || std::ranges::count(automatic.moves, id) > 0;
    return concerned && is_on(node, automatic);
  });
}

class Holder {
 public:
  explicit Holder(const VideoNode& node) : node_(node), controls_(controls_of(node)) {}

  void turn_off(const Automatic& automatic, const std::vector<CameraSetting>& values_found) {
    if (!is_on(node_, automatic)) return;
    set_value(node_, automatic.id, automatic.off);
    if (is_on(node_, automatic)) {
      append_sentence(warning_,
                      name_of(automatic.id) + " stays automatic: the driver does not let it be held");
      return;
    }
    for (const CameraSetting& found : values_found) {
      const Control* control = control_named(found.name);
      if (control != nullptr && std::ranges::count(automatic.moves, control->id) > 0)
        set_value(node_, control->id, static_cast<std::int32_t>(found.value));
    }
  }

  void set(const std::string& name, std::int64_t value) {
    const Control* control = control_named(name);
    if (control == nullptr)
      throw Error(node_.path() + ": the camera has no control \"" + name + "\"" + what_there_is(name));
    const bool in_range = value >= control->minimum && value <= control->maximum;
    const int code = in_range ? set_value(node_, control->id, static_cast<std::int32_t>(value)) : ERANGE;
    if (code == 0) return;
    if (code == ENODEV) throw node_.failure("set " + name, code);
    throw Error(node_.path() + ": the camera does not take " + name + "=" + std::to_string(value) +
                "; its range is " + std::to_string(control->minimum) + " to " +
                std::to_string(control->maximum));
  }

  ControlReport report() const { return {read(), warning_}; }

  std::vector<CameraSetting> read() const {
    std::vector<CameraSetting> settings;
    for (const Control& control : controls_)
      if (const auto value = value_of(node_, control.id))
        settings.push_back({control.name, *value, !is_moved(node_, control.id)});
    return settings;
  }

 private:
  const Control* control_named(const std::string& name) const {
    const auto found = std::ranges::find(controls_, name, &Control::name);
    return found == controls_.end() ? nullptr : &*found;
  }
  std::string name_of(std::uint32_t id) const {
    const auto found = std::ranges::find(controls_, id, &Control::id);
    return found == controls_.end() ? "a control" : found->name;
  }
  std::string what_there_is(const std::string& name) const {
    std::vector<std::string> names;
    for (const Control& control : controls_) names.push_back(control.name);
    const std::string near = nearest_name(name, names);
    if (!near.empty()) return ", did you mean " + near + "?";
    std::string text;
    for (const std::string& one : names) text += (text.empty() ? ", but " : ", ") + one;
    return text.empty() ? ", nor any other" : text;
  }

  const VideoNode& node_;
  std::vector<Control> controls_;
  std::string warning_;
};

}  // namespace

bool has_automatics_on(const VideoNode& node) {
  return std::ranges::any_of(kAutomatics, [&](const Automatic& a) { return is_on(node, a); });
}

ControlReport hold_controls(const VideoNode& node,
                            const std::vector<std::pair<std::string, std::int64_t>>& wanted,
                            const std::vector<CameraSetting>& values_found) {
  Holder holder(node);
  for (const Automatic& automatic : kAutomatics) holder.turn_off(automatic, values_found);
  for (const auto& [name, value] : wanted) holder.set(name, value);
  return holder.report();
}

std::vector<CameraSetting> read_controls(const VideoNode& node) { return Holder(node).read(); }

}  // namespace gelslam::detail
