#include "gelslam/slam/merge_scans.hpp"

#include <chrono>
#include <memory>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/index.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/slam/continue_scan.hpp"
#include "gelslam/slam/mapper.hpp"
#include "gelslam/slam/store.hpp"
#include "run_folder/run_writer.hpp"

namespace gelslam {
namespace {

namespace fs = std::filesystem;

/// Appends `next` to `all`; the numbers of keyframes, trials and frames, and the times, run on.
void append(ScanRecord& all, const ScanRecord& next) {
  const int keyframes = all.last_keyframe() + 1, trials = all.last_trial() + 1;
  const std::int64_t frames = all.next_frame();
  const double time_s = all.next_time_s();
  for (ScanPart part : next.parts) {
    part.first_frame += frames;
    all.parts.push_back(std::move(part));
  }
  for (const auto& keyframe : next.keyframes) {
    auto renamed = keyframe ? std::make_shared<Keyframe>(*keyframe) : nullptr;
    if (renamed) {
      renamed->id += keyframes;
      renamed->frame += frames;
      renamed->trial += trials;
    }
    all.searched.push_back(renamed && !renamed->is_patch);
    all.keyframes.push_back(std::move(renamed));
  }
  for (PoseGraphEdge edge : next.edges) {
    edge.from += keyframes;
    edge.to += keyframes;
    all.edges.push_back(edge);
  }
  for (FrameRecord frame : next.frames) {
    frame.frame += frames;
    frame.time_s += time_s;
    if (frame.trial >= 0) frame.trial += trials;
    if (frame.keyframe >= 0) frame.keyframe += keyframes;
    all.frames.push_back(frame);
  }
}

/// Returns one record of all scans, with the loops between them.
ScanRecord joined(const std::vector<ScanRecord>& records, const SlamOptions& options, ProgressSink& progress,
                  const std::function<bool()>& stop_requested) {
  LoopCloser closer(options.loop_closure, options.registration, options.verification);
  ScanRecord all;
  for (const ScanRecord& record : records) {
    const std::size_t known = all.keyframes.size();
    append(all, record);
    std::vector<Keyframe> added;
    for (std::size_t id = known; id < all.keyframes.size(); ++id)
      if (all.searched[id]) added.push_back(*all.keyframes[id]);
    if (known > 0) {
      std::int64_t done = 0;
      progress.begin("looking for common places", static_cast<std::int64_t>(added.size()));
      for (const Keyframe& keyframe : added) {
        // A session cannot record that loops between its parts were not searched for.
        if (stop_requested()) throw Error("stopped; nothing was written");
        std::vector<PoseGraphEdge> loops = closer.recognize(keyframe);
        if (loops.size() > index(options.loop_closure.max_constraints))
          loops.resize(index(options.loop_closure.max_constraints));
        all.edges.insert(all.edges.end(), loops.begin(), loops.end());
        progress.update(++done);
      }
      progress.end();
    }
    closer.keep(added);
  }
  return all;
}

void check_distinct(const std::vector<fs::path>& runs) {
  std::error_code code;
  for (std::size_t i = 0; i < runs.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (runs[k].lexically_normal() == runs[i].lexically_normal() || fs::equivalent(runs[k], runs[i], code))
        throw Error(runs[i].string() + ": is given twice");
}

}  // namespace

Run merge_scans(const MergeRequest& request, ProgressSink& progress,
                const std::function<bool()>& stop_requested) {
  const auto start = std::chrono::steady_clock::now();
  if (request.runs.size() < 2) throw Error("name at least two runs to join");
  check_distinct(request.runs);
  for (const fs::path& run : request.runs) check_is_run(run, RunNeeds::record);
  RunFolder folder(request.run_folder, {.overwrite = request.overwrite, .inputs = request.runs});
  const Config config = read_config(request.runs.front() / "config.yaml");
  std::vector<ScanRecord> records;
  for (const fs::path& run : request.runs) {
    records.push_back(read_scan(run, config.slam.registration));
    // Searches the loops of keyframes whose search was still outstanding when a scan was aborted.
    for (const auto& [keyframe, loops] : Mapper(config.slam).restore(records.back()))
      records.back().edges.insert(records.back().edges.end(), loops.begin(), loops.end());
    for (ScanPart& part : records.back().parts)
      if (part.log.empty()) part.log = run.string();
  }
  for (std::size_t i = 0; i < records.size(); ++i)
    check_same_sensor(request.runs[i], records[i], records.front().parts.back(), config.sensor);
  const ScanRecord all = joined(records, config.slam, progress, stop_requested);
  StageTimer timer;
  Run run = finish_scan(config, all, std::to_string(records.size()) + " joined runs", timer, start, progress,
                        stop_requested);
  write_run(folder.path(), run);
  folder.commit();
  return run;
}

}  // namespace gelslam
