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

/// The contents of a run folder for other programs. For a mesh file only the name and the mesh are set.
struct RunContents : RunFiles {
  std::string name;  ///< Name of the folder or file, for the user.
  Mesh mesh;         ///< Map frame, mm; empty if the run has none.
  /// At least one for a run folder; several if it was continued or merged.
  std::vector<RunReport::Log> logs;
  /// Read images also from logs outside the run folder. By default this is not done, because a report from
  /// elsewhere may name any file.
  bool takes_any_log = false;
  /// Statistics from report.json as text: {"Loops", "89"}.
  std::vector<std::pair<std::string, std::string>> figures;
  /// Sentences, for example about components that are not joined, or a partial run.
  std::vector<std::string> warnings;
};

/// Reads a run folder or a mesh file. A run without mesh or report is read as far as possible. Throws Error
/// for anything else, and for damaged files.
RunContents read_run_contents(const std::filesystem::path& run_or_mesh);

/// Converts mm to m, rounded to a nanometer so that the text is short.
inline double meters(double mm) { return std::round(mm * 1e6) / 1e9; }

enum class MeshColor { none, confidence, height };

/// Returns the colors used by the windows: confidence from 0 to its 95th percentile, or height along -z of
/// the map from the lowest to the highest. Empty for `none`. Throws Error when the mesh has no confidence.
VertexColors vertex_colors(const Mesh& mesh, MeshColor color);

/// Result of writing an MCAP file.
struct McapOutcome {
  std::int64_t poses = 0, pictures = 0;
  std::string missing;  ///< What could not be written, as a sentence, or "".
};

/// Writes a run as MCAP (https://mcap.dev/spec) with Foxglove's JSON messages; docs/file-formats.md lists the
/// topics. Images come from `logs`, cropped and resized as the tracker saw them. If a log is missing or
/// damaged, or must not be read, only its images are left out. The file appears only when it is complete.
/// Throws Error when the disk is full.
McapOutcome write_mcap(const std::filesystem::path& path, const RunContents& run, const VertexColors& colors,
                       ProgressSink& progress);

/// Writes a self-contained HTML page (WebGL 2, no network): the mesh to be turned, the trajectory, statistics
/// and warnings. `color` is the initial coloring; it can be changed in the page. Throws Error when the run
/// has no mesh.
void write_page(const std::filesystem::path& path, const RunContents& run, MeshColor color);

}  // namespace gelslam
