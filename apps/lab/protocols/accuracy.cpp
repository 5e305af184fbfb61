#include <algorithm>

#include "gelslam/core/median.hpp"
#include "gelslam/core/se3.hpp"
#include "gelslam/evaluation/trajectory_metrics.hpp"
#include "protocols/benchmark.hpp"

namespace gelslam {
namespace {

/// Returns each name once, in order of first occurrence.
std::vector<std::string> names_of(const BenchmarkResult& result, std::string BenchmarkRecord::*name) {
  std::vector<std::string> names;
  for (const BenchmarkRecord& record : result)
    if (std::find(names.begin(), names.end(), record.*name) == names.end()) names.push_back(record.*name);
  return names;
}

using Records = std::vector<const BenchmarkRecord*>;

/// If `object` is empty, records of all objects are returned.
Records select_records(const BenchmarkResult& result, const std::string& method, const std::string& object) {
  Records records;
  for (const BenchmarkRecord& record : result)
    if (record.method == method && (object.empty() || record.object == object)) records.push_back(&record);
  return records;
}

/// Times of frames that were registered; the first one of a trial was not.
std::vector<double> times_of(const Records& records) {
  std::vector<double> times;
  for (const BenchmarkRecord* record : records)
    for (std::size_t i = 1; i < record->frames.size(); ++i) times.push_back(record->frames[i].cpu_ms);
  return times;
}

AccuracyRow accuracy(const Records& records) {
  AccuracyRow row;
  row.method = records.front()->method;
  row.trials = static_cast<int>(records.size());
  for (const BenchmarkRecord* record : records) {
    for (const FrameEstimate& frame : record->frames) {
      row.mae += axis_error(frame.first_T_frame, frame.true_first_T_frame).cwiseAbs();
      row.tracked += frame.tracked ? 1 : 0;
      ++row.frames;
    }
    const FrameEstimate& last = record->frames.back();
    row.final_mm +=
        (last.first_T_frame.translation() - last.true_first_T_frame.translation()).norm() / row.trials;
    row.final_deg += rotation_angle_rad(last.true_first_T_frame.inverse() * last.first_T_frame) *
                     kDegreesPerRadian / row.trials;
  }
  row.mae /= row.frames;
  row.geometric_mean_mm = geometric_mean_mm(row.mae);
  std::vector<double> times = times_of(records);
  row.median_ms = quantile(times, 0.5);
  row.p95_ms = quantile(times, 0.95);
  return row;
}

}  // namespace

std::vector<AccuracyRow> accuracy_by_object(const BenchmarkResult& result) {
  std::vector<AccuracyRow> rows;
  std::vector<std::string> objects = names_of(result, &BenchmarkRecord::object);
  if (objects.size() > 1) objects.push_back("");
  for (const std::string& object : objects) {
    for (const std::string& method : names_of(result, &BenchmarkRecord::method)) {
      const Records records = select_records(result, method, object);
      if (records.empty()) continue;
      rows.push_back(accuracy(records));
      rows.back().object = object.empty() ? "all" : object;
    }
  }
  return rows;
}

}  // namespace gelslam
