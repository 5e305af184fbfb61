#pragma once

#include <filesystem>
#include <memory>

#include "gelslam/sensor/log_writer.hpp"
#include "gelslam/sensor/raw_frame.hpp"
#include "gelslam/sensor/sensor_profile.hpp"

namespace gelslam {

/// Opens a log as a source of raw frames. A Matroska file of JPEG, PNG or YUYV pictures (what LogWriter
/// makes, and what other tools make of it) gives its bytes, times and sequence numbers as they were recorded
/// (a time that is not after the last one: one frame after it); one that was cut off or never closed gives
/// what is whole, and warning() says so. Other videos, folders of images and data folders (open_frame_source)
/// give bgr frames at the profile's size. Throws Error when it is none of these.
std::unique_ptr<RawFrameSource> open_raw_log(const std::filesystem::path& log,
                                             const SensorProfile& profile = {});

/// True when the file begins as Matroska does, whatever its name. False when it cannot be read.
bool is_matroska(const std::filesystem::path& file);

/// What a Matroska log holds beside its pictures; what it lacks stays empty. Throws Error when the file is no
/// Matroska file, or an attachment is too large to be what its name says (configuration 1 MiB, model 4 MiB).
LogAttachments read_log_attachments(const std::filesystem::path& log);

/// Plays a source at the times it was recorded (steady clock; the first frame at once), `speed` times as
/// fast. A frame that is asked for too late is delivered at once, and so is one after a gap of more than 30
/// s, whose time can only be damaged; none is left out. stop() wakes a waiting next(). Throws Error when
/// `speed` is no positive number.
std::unique_ptr<RawFrameSource> pace(std::unique_ptr<RawFrameSource> source, double speed = 1.0);

}  // namespace gelslam
