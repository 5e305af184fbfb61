// How did the sensor move between two touches? Usage: register_two_touches MODEL BACKGROUND TOUCH_A TOUCH_B
#include <gelslam/core/error.hpp>
#include <gelslam/registration/relocalization.hpp>
#include <gelslam/sensor/image_input.hpp>
#include <gelslam/surface/model_file.hpp>
#include <gelslam/surface/surface_estimator.hpp>
#include <iostream>

int main(int argc, char** argv) try {
  if (argc != 5) throw gelslam::Error("usage: register_two_touches MODEL BACKGROUND TOUCH_A TOUCH_B");
  const gelslam::SensorProfile profile;  // GelSight Mini, 320x240
  const auto read = [&](const char* file) {
    return gelslam::fit_to_profile(gelslam::read_image(file), profile, file);
  };
  gelslam::SurfaceEstimator estimator(gelslam::read_model(argv[1]), read(argv[2]), {});
  const gelslam::SurfacePtr a = estimator.estimate(read(argv[3]));
  const gelslam::SurfacePtr b = estimator.estimate(read(argv[4]));

  const gelslam::NormalFlowOptions options;
  const gelslam::NormalFlowReference reference(a, options);
  const gelslam::Pose expected = gelslam::Pose::Identity();
  gelslam::RegistrationResult result = gelslam::register_normal_flow(reference, *b, expected, options);
  // One registration bridges a small motion; the search bridges any shift.
  if (!result.ok()) result = gelslam::relocalize(reference, *b, expected, result, options, {});
  if (!result.ok()) std::cout << "not registered: " << gelslam::describe(result.status) << "\n";
  std::cout << "b_T_a (mm):\n" << result.target_T_reference.matrix() << "\n";
  std::cout << gelslam::describe_observability(result.observable) << "\n";
  return result.ok() ? 0 : 1;
} catch (const gelslam::Error& error) {
  std::cerr << error.what() << "\n";
  return 2;
}
