#pragma once

#include <cstdint>
#include <filesystem>
#include <string>

#include "gelslam/core/progress.hpp"
#include "gelslam/exchange/run_contents.hpp"

namespace gelslam {

/// What an MCAP file got.
struct McapOutcome {
  std::int64_t poses = 0, pictures = 0;
  std::string missing;  ///< what could not be written, as a sentence, or ""
};

/// Writes a run as MCAP (https://mcap.dev/spec) with Foxglove's JSON messages; docs/file-formats.md lists
/// the topics. Pictures come from `logs`, cropped and resized as the tracker saw them. A log
/// that is missing or damaged costs its pictures only. Appears whole or not at all. Throws Error when the
/// disk is full.
McapOutcome write_mcap(const std::filesystem::path& path, const RunContents& run, const VertexColors& colors,
                       ProgressSink& progress);

/// Writes one page (HTML with everything in it, WebGL 2, no network): the mesh to turn around, the
/// trajectory, figures and warnings. `color` is what it shows first; it can be changed in the page. Throws
/// Error when the run has no mesh.
void write_page(const std::filesystem::path& path, const RunContents& run, MeshColor color);

}  // namespace gelslam
