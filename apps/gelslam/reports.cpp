#include "reports.hpp"

#include <fmt/core.h>
#include <unistd.h>

#include <iostream>

#include "command_line.hpp"
#include "gelslam/core/text.hpp"
#include "terminal_progress.hpp"

namespace gelslam {

std::string map_words(const RunReport& r) {
  return counted(r.frames.in_map, "frame") + " in the map; " + counted(r.trials, "trial") + " in " +
         counted(r.components, "component") + ", " + counted(r.keyframes, "keyframe") + ", " +
         counted(r.loops, "loop");
}

std::string mesh_words(const RunReport::MeshSize& mesh) {
  std::string text = "no mesh";
  if (mesh.triangles > 0)
    text =
        "mesh of " + std::to_string(mesh.vertices) + " vertices and " + counted(mesh.triangles, "triangle");
  if (mesh.islands_left_out > 0)
    text += ", without " + counted(mesh.islands_left_out, "island") + " (gelslam fuse --keep-all keeps them)";
  return text;
}

std::string touched_line(const RunReport::Touched& touched) {
  const std::string words = describe(touched);
  return words.empty() ? "" : words + "\n";
}

std::string warning_words(const std::vector<std::string>& warnings) {
  std::string text;
  for (const std::string& sentence : warnings)
    text += amber("warning: " + terminal_line(sentence), STDERR_FILENO) + "\n";
  return text;
}

void print_run_warnings(const std::filesystem::path& run_folder) {
  if (const auto report = find_report(run_folder)) std::cerr << warning_words(report->result_warnings);
}

std::string run_words(const RunReport& r, const std::string& run_folder, bool quiet) {
  std::string text;
  if (r.partial) text += "stopped early: this is what was seen so far\n";
  text += warning_words(r.warnings);
  const std::string last = warning_words(r.result_warnings);
  if (quiet) return text + last;
  for (const std::string& part : r.parts) text += one_line(part) + "\n";
  text += fmt::format("{} of {} frames tracked, {}\n{}{}, in {} s: {}\n", r.frames.tracked, r.frames.total,
                      map_words(r), touched_line(r.touched), mesh_words(r.mesh), short_number(r.seconds, 3),
                      one_line(run_folder));
  return text + last;
}

void warn(const std::string& warning) {
  if (!warning.empty()) std::cerr << warning_words({warning});
}

}  // namespace gelslam
