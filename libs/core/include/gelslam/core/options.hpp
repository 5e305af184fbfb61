#pragma once

#include <array>
#include <filesystem>
#include <functional>
#include <string>
#include <string_view>

namespace gelslam {

/// A visitor of all keys of a configuration. The keys are described once, by a function that calls these
/// methods for every field of an options struct. The description is used to read the keys, to write them with
/// their comments, and to detect unknown ones:
///
///   void describe_options(OptionVisitor& visit, TrackOptions& options) {
///     visit.number("scr_threshold", options.scr_threshold, 0, 1, "least shared curvature ratio");
///   }
///   read_options("config.yaml", [&](OptionVisitor& visit) {
///     visit.section("gelslam_config", "", [&] {
///       visit.section("track_config", "", [&] { describe_options(visit, options); });
///     });
///   });
///
/// The field's value before reading is the default of a key that is not given. Bounds are inclusive.
class OptionVisitor {
 public:
  virtual ~OptionVisitor() = default;
  /// Visits a section. Returns whether the file has it.
  virtual bool section(const std::string& key, const std::string& comment,
                       const std::function<void()>& fields) = 0;
  virtual void number(const std::string& key, double& value, double min, double max,
                      const std::string& comment) = 0;
  /// Visits a list of two numbers, "[1.5, 2]".
  virtual void pair(const std::string& key, std::array<double, 2>& values, double min, double max,
                    const std::string& comment) = 0;
  virtual void integer(const std::string& key, int& value, int min, int max, const std::string& comment) = 0;
  virtual void flag(const std::string& key, bool& value, const std::string& comment) = 0;
  virtual void text(const std::string& key, std::string& value, const std::string& comment) = 0;
  /// Visits a path. Relative names are relative to the configuration file's folder; a \ in a name that does
  /// not exist is read as /. After reading, `value` is absolute or empty.
  virtual void path(const std::string& key, std::filesystem::path& value, const std::string& comment) = 0;
  /// Accepts a key that has no effect. It is not written.
  virtual void ignored(const std::string& key) = 0;
};

using OptionList = std::function<void(OptionVisitor&)>;

/// Reads a YAML file into the fields. Throws Error "config.yaml:12: ..." with the line, for a missing or
/// unreadable file, more than 1 MiB, bad syntax, a value of the wrong type or out of bounds, a duplicate key,
/// and an unknown key (with the nearest known one). After an error, fields that were read before it have
/// changed.
void read_options(const std::filesystem::path& file, const OptionList& options);

/// Reads options from text; `name` stands for the file in errors, and relative paths are relative to its
/// folder.
void read_options_text(std::string_view yaml, const std::filesystem::path& name, const OptionList& options);

/// Returns the fields as YAML, one key per line with its comment and bounds. read_options() reads exactly the
/// same values back.
std::string write_options(const OptionList& options);

}  // namespace gelslam
