#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "../support/run_program.hpp"
#include "ablation_case.hpp"
#include "ablation_variants.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/evaluation/evaluation.hpp"
#include "gelslam/sensor/sensor_profile.hpp"
#include "gelslam/simulation/data_folder.hpp"
#include "gelslam/slam/reconstruct.hpp"
#include "gelslam/surface/model_file.hpp"
#include "simulated_frames.hpp"

namespace gelslam {
namespace {

using namespace test;
using lab::simulated_frames;
using Json = nlohmann::ordered_json;

/// A set of one short log.
struct SmallSet {
  SmallSet() {
    ScanSpec spec;
    spec.object.name = "pebble";
    spec.motion.frames = 45;
    DataFolderOptions options;
    options.model = folder / "nnmodel.pth";
    write_pth_model(options.model, simulated_frames().model);
    NoProgress quiet;
    write_data_folder(log, Simulator(spec), options, quiet);
  }

  Json measured(std::vector<std::string> arguments) const {
    const std::string study = folder / "study";
    arguments.insert(arguments.begin(), {"ablation", folder / "set"});
    arguments.insert(arguments.end(), {"-o", study});
    const ProgramResult result = run_program(GELSLAM_LAB, arguments);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return result.exit_code == 0 ? Json::parse(read_bytes(study + "/ablation.json")) : Json::array();
  }

  /// By the program's own way through run folders.
  Evaluation evaluated(bool refine) const {
    ReconstructRequest request;
    request.input.log = log;
    request.config = resolve_config(request.input);
    if (!refine) request.config.slam.refinement.max_pairs_per_keyframe = 0;
    request.run_folder = folder / "run";
    request.overwrite = true;
    NoProgress quiet;
    reconstruct(request, quiet, [] { return false; });
    const Comparison comparison = compare(request.run_folder, log);
    return evaluate(comparison, place_meshes(comparison));
  }

  TemporaryFolder folder;
  std::filesystem::path log = folder / "set/pebble";
};

TEST(Ablation, AgreesWithReconstructAndEvaluate) {
  const SmallSet set;
  const Json rows = set.measured({"--only", "overlap edges"});
  ASSERT_EQ(rows.size(), 2U);
  for (const int row : {0, 1}) {
    const Evaluation expected = set.evaluated(/*refine=*/row == 0);
    EXPECT_NEAR(rows[row]["error_mm"], expected.trajectory->geometric_mean_mm, 1e-6);
    EXPECT_NEAR(rows[row]["mesh_mm"], expected.mesh->at_known_pose.accuracy.mean_mm, 1e-4);
    EXPECT_EQ(rows[row]["share"], expected.trajectory->tracked_share());
    EXPECT_EQ(rows[row]["frames"], 45);
    EXPECT_EQ(rows[row]["silent"], 0);
    EXPECT_GT(rows[row]["error_over_sigma"], 0.05);
    EXPECT_LT(rows[row]["error_over_sigma"], 3);
  }
  EXPECT_NE(rows[0]["error_mm"], rows[1]["error_mm"]);
  const Json table = Json::parse(read_bytes(set.folder / "study/ablation_table.json"));
  ASSERT_EQ(table.size(), 2U);
  EXPECT_EQ(table[0]["set"], "set");
  EXPECT_EQ(table[1]["set"], "all");
  const double ratio = rows[1]["error_mm"].get<double>() / rows[0]["error_mm"].get<double>();
  EXPECT_NEAR(table[0]["error"], ratio, 1e-9);
  EXPECT_NEAR(table[1]["error"], ratio, 1e-9);
  if (run_program("/usr/bin/python3", {"-c", "import matplotlib"}).exit_code != 0) return;
  const ProgramResult drawn = run_program(
      "/usr/bin/python3", {std::string(GELSLAM_SCRIPTS) + "/plot_ablation.py", set.folder / "study"});
  EXPECT_EQ(drawn.exit_code, 0) << drawn.err;
  EXPECT_THAT(read_bytes(set.folder / "study/ablation.png"), testing::StartsWith("\x89PNG"));
}

Json row(const std::string& sequence, const std::string& variant, const Json& error_mm, int silent) {
  return {{"set", "set"},         {"sequence", sequence}, {"model", "default"}, {"variant", variant},
          {"tracked", 9},         {"share", 0.5},         {"pieces", 1},        {"loops", 2},
          {"error_mm", error_mm}, {"mesh_mm", nullptr},   {"silent", silent},   {"error_over_sigma", 1},
          {"frame_ms", 1},        {"finish_ms", 1}};
}

TEST(Ablation, TableHasMeanWorstAndBest) {
  const Json rows = {row("a", "on", 0.1, 3), row("a", "x", 0.4, 5),  row("b", "on", 0.2, 0),
                     row("b", "x", 0.1, 0),  row("c", "on", 0.2, 1), row("c", "x", nullptr, 0)};
  const Json table = lab::ablation_table(lab::ablation_ratios(rows, "on"));
  ASSERT_EQ(table.size(), 2U);
  EXPECT_NEAR(table[0]["error"], std::sqrt(4 * 0.5), 1e-12);
  EXPECT_EQ(table[0]["worst"], "0.50 b");
  EXPECT_EQ(table[0]["best"], "4.00 a");
  EXPECT_EQ(table[0]["logs"], 3);
  EXPECT_EQ(table[0]["silent_with"], 4);
  EXPECT_EQ(table[0]["silent_without"], 5);
  EXPECT_TRUE(table[0]["mesh"].is_null());
}

TEST(AblationVariants, SetKeysOfTheConfiguration) {
  Config config;
  config.sensor.device_name = "mine";
  const Config changed = lab::with_settings(
      config, lab::parse_variant("mine: refine_pairs_per_keyframe=0, track_config.scr_threshold = 0.25"));
  EXPECT_EQ(changed.slam.refinement.max_pairs_per_keyframe, 0);
  EXPECT_EQ(changed.slam.registration.curvature.min_scr, 0.25);
  EXPECT_EQ(changed.slam.verification.curvature.min_scr, config.slam.verification.curvature.min_scr);
  EXPECT_EQ(changed.sensor.device_name, "mine");
  config.surface.optics = kGelSightMiniOptics;
  const Config domed =
      lab::with_settings(config, lab::parse_variant("domed: gel_dome_per_mm=[0.001, 0.002], lens_k1=0.02"));
  EXPECT_EQ(domed.surface.optics.gel_dome_per_mm, (std::array{0.001, 0.002}));
  EXPECT_EQ(domed.surface.optics.lens_k1, 0.02);
  for (const char* key :
       {"keyframe_min_shared=0.7", "max_samples=1000", "voxel_size_mm=0.2"})  // what is spent
    EXPECT_NE(write_config(lab::with_settings(config, lab::parse_variant(std::string("x: ") + key))),
              write_config(config))
        << key;
  for (const lab::Variant& variant : lab::mechanism_variants())
    EXPECT_NE(write_config(lab::with_settings(config, variant)), write_config(config)) << variant.name;
}

TEST(AblationVariants, MistakesAreOneLine) {
  const TemporaryFolder folder;
  const std::vector<std::pair<std::string, std::string>> mistakes = {
      {"mine: refin=false", "no key refin"},
      {"mine: scr_threshold=0.1", "section.key"},
      {"mine: relocalize=perhaps", "relocalize"},
      {"mine", "name: key=value"},
      {"mine: refine", "name: key=value"}};
  for (const auto& [text, words] : mistakes)
    expect_mistake(run_program(GELSLAM_LAB, {"ablation", folder.path().string(), "--set", text}), words,
                   "gelslam-lab");
  expect_mistake(run_program(GELSLAM_LAB, {"ablation"}), "DATA is required", "gelslam-lab");
}

}  // namespace
}  // namespace gelslam
