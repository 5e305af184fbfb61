#include "baselines/baselines.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/text.hpp"

namespace gelslam {

const std::vector<std::string>& registrar_names() {
  static const std::vector<std::string> names = {"normalflow", "icp",       "icp-tuned",      "fpfh",
                                                 "fpfh-tuned", "filterreg", "filterreg-tuned"};
  return names;
}

Registrar make_registrar(std::string_view name, const NormalFlowOptions& options) {
  if (name == "normalflow") return make_normal_flow(options);
  if (name == "icp") return make_icp(IcpOptions{}, options);
  if (name == "icp-tuned") return make_icp(tuned_icp(), options);
  if (name == "fpfh") return make_fpfh(FpfhOptions{}, options);
  if (name == "fpfh-tuned") return make_fpfh(tuned_fpfh(), options);
  if (name == "filterreg") return make_filter_reg(FilterRegOptions{}, options);
  if (name == "filterreg-tuned") return make_filter_reg(tuned_filter_reg(), options);
  const std::string near = nearest_name(std::string(name), registrar_names());
  std::string known;
  for (const std::string& one : registrar_names()) known += (known.empty() ? "" : ", ") + one;
  throw Error("there is no method '" + std::string(name) + "'" +
              (near.empty() ? " (there are " + known + ")" : ", did you mean " + near + "?"));
}

IcpOptions tuned_icp() { return {.max_distance_mm = 0.2}; }

FpfhOptions tuned_fpfh() { return {.max_distance_mm = 0.2, .refinement = tuned_icp()}; }

FilterRegOptions tuned_filter_reg() {
  return {.variance_mm2 = 0.005, .tolerance_mm2 = 1e-4, .outlier_share = 0.3};
}

}  // namespace gelslam
