#include <zip.h>

#include <bit>
#include <cstring>
#include <memory>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gelslam/core/atomic_file.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/simulation/trainer.hpp"

namespace gelslam {
namespace {

static_assert(std::endian::native == std::endian::little,
              "tensors and pickles are written as they lie in memory");

template <typename Number>
std::string bytes_of(Number number) {
  std::string bytes(sizeof number, '\0');
  std::memcpy(bytes.data(), &number, sizeof number);
  return bytes;
}

/// The few opcodes of pickle protocol 2 that a state_dict takes (Python's pickletools.py describes them).
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
  Pickle& tuple() { return add("t"); }  ///< of everything since the mark
  Pickle& empty_tuple() { return add(")"); }
  Pickle& call() { return add("R"); }
  Pickle& persistent_id() { return add("Q"); }
  Pickle& set_items() { return add("u"); }  ///< pairs since the mark, into the dictionary before it
  std::string finish() { return add(".").bytes_; }

 private:
  Pickle& add(std::string_view bytes) {
    bytes_.append(bytes);
    return *this;
  }
  std::string bytes_ = "\x80\x02";
};

struct Tensor {
  std::string name;
  std::vector<int> shape;
  const std::vector<float>* values;
};

std::vector<Tensor> tensors_of(const SimulatedNetwork& network) {
  std::vector<Tensor> tensors;
  for (std::size_t l = 0; l < network.weight.size(); ++l) {
    const std::string layer = "fc" + std::to_string(l + 1);
    tensors.push_back({layer + ".weight", {network.sizes[l + 1], network.sizes[l]}, &network.weight[l]});
    tensors.push_back({layer + ".bias", {network.sizes[l + 1]}, &network.bias[l]});
  }
  return tensors;
}

/// OrderedDict of torch._utils._rebuild_tensor_v2(storage, offset, shape, stride, requires_grad, hooks).
std::string pickle_of(const std::vector<Tensor>& tensors) {
  Pickle pickle;
  pickle.global("collections", "OrderedDict").empty_tuple().call().mark();
  for (std::size_t k = 0; k < tensors.size(); ++k) {
    const Tensor& tensor = tensors[k];
    pickle.text(tensor.name).global("torch._utils", "_rebuild_tensor_v2").mark();
    pickle.mark().text("storage").global("torch", "FloatStorage").text(std::to_string(k)).text("cpu");
    pickle.number(static_cast<int>(tensor.values->size())).tuple().persistent_id().number(0);
    pickle.mark();
    for (const int size : tensor.shape) pickle.number(size);
    pickle.tuple().mark();
    if (tensor.shape.size() == 2) pickle.number(tensor.shape[1]);
    pickle.number(1).tuple().no();
    pickle.global("collections", "OrderedDict").empty_tuple().call().tuple().call();
  }
  return pickle.set_items().finish();
}

struct Discard {
  void operator()(zip_t* archive) const { zip_discard(archive); }
};

void check(bool good, const std::filesystem::path& path) {
  if (!good) throw Error("cannot write " + path.string() + "; is the disk full?");
}

/// Stored, not compressed, as PyTorch wants it; with a fixed date, so that the same network gives the same
/// bytes.
void add_entry(zip_t* archive, const std::string& name, const std::string& contents,
               const std::filesystem::path& path) {
  zip_source_t* source = zip_source_buffer(archive, contents.data(), contents.size(), 0);
  check(source != nullptr, path);
  const zip_int64_t index = zip_file_add(archive, name.c_str(), source, ZIP_FL_ENC_UTF_8);
  if (index < 0) zip_source_free(source);
  check(index >= 0, path);
  const auto entry = static_cast<zip_uint64_t>(index);
  constexpr zip_uint16_t first_of_1980 = 0x21;
  check(zip_set_file_compression(archive, entry, ZIP_CM_STORE, 0) == 0, path);
  check(zip_file_set_dostime(archive, entry, 0, first_of_1980, 0) == 0, path);
}

}  // namespace

void write_pth(const std::filesystem::path& path, const SimulatedNetwork& network) {
  const std::vector<Tensor> tensors = tensors_of(network);
  std::vector<std::pair<std::string, std::string>> entries;  // must outlive zip_close, which reads them
  entries.emplace_back("nnmodel/data.pkl", pickle_of(tensors));
  entries.emplace_back("nnmodel/byteorder", "little");
  for (std::size_t k = 0; k < tensors.size(); ++k) {
    std::string bytes(tensors[k].values->size() * sizeof(float), '\0');
    std::memcpy(bytes.data(), tensors[k].values->data(), bytes.size());
    entries.emplace_back("nnmodel/data/" + std::to_string(k), std::move(bytes));
  }
  entries.emplace_back("nnmodel/version", "3\n");
  TemporaryFile file(path);
  int error = 0;
  std::unique_ptr<zip_t, Discard> archive(zip_open(file.path().c_str(), ZIP_CREATE | ZIP_TRUNCATE, &error));
  check(archive != nullptr, path);
  for (const auto& [name, contents] : entries) add_entry(archive.get(), name, contents, path);
  check(zip_close(archive.get()) == 0, path);
  static_cast<void>(archive.release());
  file.commit();
}

}  // namespace gelslam
