#include <fmt/core.h>

#include <array>
#include <nlohmann/json.hpp>

#include "gelslam/core/files.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/evaluation/trajectory_metrics.hpp"
#include "protocols/report.hpp"

namespace gelslam {
namespace {

using Json = nlohmann::ordered_json;

constexpr std::array<const char*, 6> kAxes = {"x_mm", "y_mm", "z_mm", "rx_deg", "ry_deg", "rz_deg"};

/// A CSV field: names of folders may hold anything.
std::string quoted(const std::string& text) {
  if (text.find_first_of(",\"\n\r") == std::string::npos) return text;
  std::string field = "\"";
  for (const char c : text) field += c == '"' ? "\"\"" : std::string(1, c);
  return field + "\"";
}

std::string axis_names(const std::string& prefix) {
  std::string names;
  for (const char* axis : kAxes) names += "," + prefix + axis;
  return names;
}

std::string fields(const SixAxes& values) {
  std::string text;
  for (const double value : values) text += fmt::format(",{:.6g}", value);
  return text;
}

std::string accuracy_csv(const std::vector<AccuracyRow>& rows) {
  std::string text = "method,object,trial,trials,frames,tracked_share" + axis_names("") +
                     ",geometric_mean_mm,final_mm,final_deg,median_ms,p95_ms\n";
  for (const AccuracyRow& row : rows)
    text += quoted(row.method) + "," + quoted(row.object) + "," + quoted(row.trial) +
            fmt::format(",{},{},{:.4f}", row.trials, row.frames, row.tracked_share()) + fields(row.mae) +
            fmt::format(",{:.6g},{:.6g},{:.6g},{:.6g},{:.6g}\n", row.geometric_mean_mm, row.final_mm,
                        row.final_deg, row.median_ms, row.p95_ms);
  return text;
}

std::string runtime_csv(const BenchmarkResult& result) {
  std::string text = "method,low_ms,high_ms,frames\n";
  for (const RuntimeBin& bin : runtime_histogram(result))
    text += quoted(bin.method) + fmt::format(",{:.6g},{:.6g},{}\n", bin.low_ms, bin.high_ms, bin.frames);
  return text;
}

std::string error_csv(const BenchmarkResult& result) {
  std::string text = "method,object,frame,trials" + axis_names("mean_") + axis_names("deviation_") + "\n";
  for (const ErrorBand& band : error_bands(result))
    text += quoted(band.method) + "," + quoted(band.object) + fmt::format(",{},{}", band.frame, band.trials) +
            fields(band.mean) + fields(band.deviation) + "\n";
  return text;
}

std::string frames_csv(const BenchmarkResult& result) {
  std::string text =
      "method,object,trial,frame,time_s,tracked,cpu_ms" + axis_names("") + axis_names("true_") + "\n";
  for (const BenchmarkRecord& record : result.records) {
    const std::string names =
        quoted(record.method) + "," + quoted(record.object) + "," + quoted(record.trial);
    for (const FrameEstimate& frame : record.frames)
      text += names +
              fmt::format(",{},{:.6f},{},{:.6g}", frame.frame, frame.time_s, frame.tracked ? 1 : 0,
                          frame.cpu_ms) +
              fields(six_axes(frame.first_T_frame)) + fields(six_axes(frame.true_first_T_frame)) + "\n";
  }
  return text;
}

Json to_json(const AccuracyRow& row) {
  Json json = {{"method", row.method}, {"object", row.object}, {"trial", row.trial},
               {"trials", row.trials}, {"frames", row.frames}, {"tracked_share", row.tracked_share()}};
  for (std::size_t axis = 0; axis < 6; ++axis) json["mae"][kAxes[axis]] = row.mae[axis];
  json["geometric_mean_mm"] = row.geometric_mean_mm;
  json["final_mm"] = row.final_mm;
  json["final_deg"] = row.final_deg;
  json["median_ms"] = row.median_ms;
  json["p95_ms"] = row.p95_ms;
  return json;
}

Json to_json(const std::vector<AccuracyRow>& rows) {
  Json json = Json::array();
  for (const AccuracyRow& row : rows) json.push_back(to_json(row));
  return json;
}

}  // namespace

std::string to_table(const BenchmarkResult& result) {
  std::string text = fmt::format(
      "{:<16} {:<16} {:>6} {:>5} {:>7} {:>7} {:>7} {:>7} {:>7} {:>7} {:>8} {:>9}\n", "object", "method",
      "frames", "share", "x mm", "y mm", "z mm", "rx deg", "ry deg", "rz deg", "mean mm", "median ms");
  for (const AccuracyRow& row : accuracy_by_object(result))
    text += fmt::format(
        "{:<16.40} {:<16} {:6} {:5.2f} {:7.3f} {:7.3f} {:7.3f} {:7.2f} {:7.2f} {:7.2f} {:8.4f} {:9.2f}\n",
        row.object, row.method, row.frames, row.tracked_share(), row.mae[0], row.mae[1], row.mae[2],
        row.mae[3], row.mae[4], row.mae[5], row.geometric_mean_mm, row.median_ms);
  return text;
}

std::string to_json(const BenchmarkResult& result) {
  Json json;
  json["protocol"] = name(result.protocol);
  json["partial"] = result.partial;
  json["millimeters_per_degree"] = kMillimetersPerDegree;
  json["time"] = "processor time of one thread";
  json["accuracy"] = to_json(accuracy_by_object(result));
  json["trials"] = to_json(accuracy_by_trial(result));
  json["runtime"] = Json::array();
  for (const RuntimeBin& bin : runtime_histogram(result))
    json["runtime"].push_back(
        {{"method", bin.method}, {"low_ms", bin.low_ms}, {"high_ms", bin.high_ms}, {"frames", bin.frames}});
  json["error_over_time"] = Json::array();
  for (const ErrorBand& band : error_bands(result))
    json["error_over_time"].push_back({{"method", band.method},
                                       {"object", band.object},
                                       {"frame", band.frame},
                                       {"trials", band.trials},
                                       {"mean", band.mean},
                                       {"deviation", band.deviation}});
  return json.dump(1, ' ', false, Json::error_handler_t::replace) + "\n";
}

const std::vector<std::string>& benchmark_files() {
  static const std::vector<std::string> names = {"benchmark.json", "accuracy.csv",        "trials.csv",
                                                 "runtime.csv",    "error_over_time.csv", "frames.csv"};
  return names;
}

void write_benchmark(const std::filesystem::path& folder, const BenchmarkResult& result) {
  write_file_atomically(folder / "benchmark.json", to_json(result));
  write_file_atomically(folder / "accuracy.csv", accuracy_csv(accuracy_by_object(result)));
  write_file_atomically(folder / "trials.csv", accuracy_csv(accuracy_by_trial(result)));
  write_file_atomically(folder / "runtime.csv", runtime_csv(result));
  write_file_atomically(folder / "error_over_time.csv", error_csv(result));
  write_file_atomically(folder / "frames.csv", frames_csv(result));
}

}  // namespace gelslam
