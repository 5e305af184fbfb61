#pragma once

#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "gelslam/core/progress.hpp"

namespace gelslam {

/// What `gelslam info` found: each fact as words for people and as values for programs.
class InfoReport {
 public:
  InfoReport(const std::filesystem::path& path, const std::string& kind);

  void add(const std::string& key, nlohmann::ordered_json value, const std::string& words);
  /// Something that would keep the other commands from using this.
  void add_problem(const std::string& words);
  bool has_problems() const { return !problems_.empty(); }

  std::string text() const;
  std::string json() const;

 private:
  struct Fact {
    std::string key;
    nlohmann::ordered_json value;
    std::string words;
  };
  std::string path_, kind_;
  std::vector<Fact> facts_;
  std::vector<std::string> problems_;
};

/// Finds out what `path` is (a log, a data folder, a run or a file of it, a surface, calibration presses, a
/// model, a configuration, a mesh, an array) and what is in it. Throws Error when it is nothing of the kind
/// or, for a single file, damaged; a damaged part of a folder is a problem in the report.
InfoReport inspect(const std::filesystem::path& path, ProgressSink& progress);

}  // namespace gelslam
