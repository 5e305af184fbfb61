#include "gelslam/core/state_dict.hpp"
#include "gelslam/simulation/trainer.hpp"

namespace gelslam {

void write_pth(const std::filesystem::path& path, const SimulatedNetwork& network) {
  std::vector<NamedTensor> tensors;
  for (std::size_t l = 0; l < network.weight.size(); ++l) {
    const std::string layer = "fc" + std::to_string(l + 1);
    tensors.push_back({layer + ".weight", {network.sizes[l + 1], network.sizes[l]}, network.weight[l]});
    tensors.push_back({layer + ".bias", {network.sizes[l + 1]}, network.bias[l]});
  }
  write_state_dict(path, tensors);
}

}  // namespace gelslam
