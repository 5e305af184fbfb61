#pragma once

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <string>
#include <utility>
#include <vector>

#include "gelslam/core/progress.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/mesh/mesh_io.hpp"

namespace gelslam {

/// What a run folder holds for other programs. For a mesh file only the name and the mesh are set.
struct RunContents : RunFiles {
  std::string name;  ///< of the folder or file, for people
  Mesh mesh;         ///< map frame, mm; empty where the run has none
  /// At least one of a run folder; more of one that was continued, or merged.
  std::vector<RunReport::Log> logs;
  bool takes_any_log = false;  ///< pictures also of logs that are not beside the run: a report may be foreign
  /// Counts of report.json in words: {"Loops", "89"}.
  std::vector<std::pair<std::string, std::string>> figures;
  std::vector<std::string> warnings;  ///< sentences: pieces that are not joined, a partial run
};

/// Reads a run folder, or a mesh file. A run without mesh or report is read as far as it goes. Throws Error
/// for anything else, and for damaged files.
RunContents read_run_contents(const std::filesystem::path& run_or_mesh);

/// For text: to a nanometer, so that it is short.
inline double meters(double mm) { return std::round(mm * 1e6) / 1e9; }

enum class MeshColor { none, confidence, height };

/// Colors of the windows' maps: confidence from 0 to its 95th percentile, or height along -z of the map from
/// the lowest to the highest. Empty for `none`. Throws Error when the mesh has no confidence.
VertexColors vertex_colors(const Mesh& mesh, MeshColor color);

/// What was written to an MCAP file.
struct McapOutcome {
  std::int64_t poses = 0, pictures = 0;
  std::string missing;  ///< what could not be written, as a sentence, or ""
};

/// Writes a run as MCAP (https://mcap.dev/spec) with Foxglove's JSON messages; docs/file-formats.md lists the
/// topics. Pictures come from `logs`, cropped and resized as the tracker saw them. If a log is missing,
/// damaged or not to be taken, only its pictures are left out. Appears whole or not at all. Throws Error when
/// the disk is full.
McapOutcome write_mcap(const std::filesystem::path& path, const RunContents& run, const VertexColors& colors,
                       ProgressSink& progress);

/// Writes one page (HTML with everything in it, WebGL 2, no network): the mesh to turn around, the
/// trajectory, figures and warnings. `color` is what it shows first; it can be changed in the page. Throws
/// Error when the run has no mesh.
void write_page(const std::filesystem::path& path, const RunContents& run, MeshColor color);

}  // namespace gelslam
