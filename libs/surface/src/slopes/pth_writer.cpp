#include <bit>
#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <vector>

#include "gelslam/core/zip_archive.hpp"
#include "gelslam/surface/gradient_model.hpp"

namespace gelslam {
namespace {

static_assert(std::endian::native == std::endian::little,
              "tensors and pickles are written as they lie in memory");

/// A float32 tensor that is to be written. `values` are row-major, and as many as `shape` requires.
struct NamedTensor {
  std::string name;
  std::vector<int> shape;
  std::span<const float> values;
};

template <typename Number>
std::string bytes_of(Number number) {
  std::string bytes(sizeof number, '\0');
  std::memcpy(bytes.data(), &number, sizeof number);
  return bytes;
}

/// Writes the few opcodes of pickle protocol 2 that a state_dict needs. Python's pickletools.py describes
/// them.
class Pickle {
 public:
  Pickle& global(const std::string& module, const std::string& name) {
    return add("c").add(module).add("\n").add(name).add("\n");
  }
  Pickle& text(const std::string& value) {
    return add("X").add(bytes_of(static_cast<std::uint32_t>(value.size()))).add(value);
  }
  Pickle& number(int value) { return add("J").add(bytes_of(static_cast<std::int32_t>(value))); }
  Pickle& no() { return add("\x89"); }
  Pickle& mark() { return add("("); }
  Pickle& tuple() { return add("t"); }  ///< from everything since the mark
  Pickle& empty_tuple() { return add(")"); }
  Pickle& call() { return add("R"); }
  Pickle& persistent_id() { return add("Q"); }
  Pickle& set_items() { return add("u"); }  ///< puts the pairs since the mark into the dictionary before it
  std::string finish() { return add(".").bytes_; }

 private:
  Pickle& add(std::string_view bytes) {
    bytes_.append(bytes);
    return *this;
  }
  std::string bytes_ = "\x80\x02";
};

/// Returns the pickle of an OrderedDict whose values are calls of
/// torch._utils._rebuild_tensor_v2(storage, offset, shape, stride, requires_grad, hooks).
std::string pickle_of(const std::vector<NamedTensor>& tensors) {
  Pickle pickle;
  pickle.global("collections", "OrderedDict").empty_tuple().call().mark();
  for (std::size_t k = 0; k < tensors.size(); ++k) {
    const NamedTensor& tensor = tensors[k];
    pickle.text(tensor.name).global("torch._utils", "_rebuild_tensor_v2").mark();
    pickle.mark().text("storage").global("torch", "FloatStorage").text(std::to_string(k)).text("cpu");
    pickle.number(static_cast<int>(tensor.values.size())).tuple().persistent_id().number(0);
    pickle.mark();
    for (const int size : tensor.shape) pickle.number(size);
    pickle.tuple().mark();
    if (tensor.shape.size() == 2) pickle.number(tensor.shape[1]);
    pickle.number(1).tuple().no();
    pickle.global("collections", "OrderedDict").empty_tuple().call().tuple().call();
  }
  return pickle.set_items().finish();
}

}  // namespace

void write_pth_model(const std::filesystem::path& path, const GradientModel& model) {
  std::vector<NamedTensor> tensors;
  for (std::size_t l = 0; l < GradientModel::kLayers; ++l) {
    const std::string name = "fc" + std::to_string(l + 1);
    const int inputs = GradientModel::kShape.sizes[l], outputs = GradientModel::kShape.sizes[l + 1];
    tensors.push_back({name + ".weight", {outputs, inputs}, model.weight(l)});
    tensors.push_back({name + ".bias", {outputs}, model.bias(l)});
  }
  std::vector<ZipEntry> entries = {{"nnmodel/data.pkl", pickle_of(tensors)}, {"nnmodel/byteorder", "little"}};
  for (std::size_t k = 0; k < tensors.size(); ++k) {
    const std::span<const float> values = tensors[k].values;
    entries.push_back({"nnmodel/data/" + std::to_string(k),
                       std::string(reinterpret_cast<const char*>(values.data()), values.size_bytes())});
  }
  entries.push_back({"nnmodel/version", "3\n"});
  write_zip(path, entries);
}

}  // namespace gelslam
