#pragma once

#include <filesystem>

#include "gelslam/slam/config.hpp"

namespace gelslam {

/// What a person names on the command line.
struct LogInput {
  std::filesystem::path log;  ///< recorded log, video, folder of images, or data folder of the public layout
  std::filesystem::path
      config;  ///< empty: the one in the log, else config.yaml in or beside it, else the defaults
  /// nnmodel.pth or a log that holds one. Empty: the one that `config` names, else the one in the log, else
  /// the one that the log's configuration names.
  std::filesystem::path model;
  std::filesystem::path background;  ///< an image; empty: the log's first frames
  bool force = false;                ///< go on although the background frames seem to show contact
};

/// The configuration that `input` asks for, with its model's path made certain. Throws Error.
Config resolve_config(const LogInput& input);

/// The same where a model is not needed, or there is no log yet (an empty name: a camera is to be read).
Config find_config(const LogInput& input);

struct LogAttachments;
/// What a log that is recorded with this configuration should hold: the configuration, and the model's file
/// (of a log: the model in it) so that the log can be reconstructed on its own anywhere. Throws Error when
/// the model is not one.
LogAttachments attachments_of(const Config& config);

}  // namespace gelslam
