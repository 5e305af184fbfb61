// Lists the tensors that the pickle in a PyTorch file describes, without executing it. The pickle is split
// into instructions. A tensor is a text, its name, followed by a call of _rebuild_tensor_v2, whose arguments
// are read in their known order. Any other global or opcode is refused, because a pickle may run any code.

#include "slopes/pickle_reader.hpp"

#include <fmt/core.h>

#include <algorithm>
#include <span>
#include <unordered_map>

#include "gelslam/core/error.hpp"

namespace gelslam::surface::detail {
namespace {

// One instruction of a pickle file as torch.save writes it. Instructions are only listed, not executed, and
// no object refers to another one. The memory that a file takes is therefore proportional to its size.
struct PickleToken {
  unsigned char opcode;  // 'K' stands for integers of any length
  std::int64_t integer = 0;
  std::string_view text;  // a text, or the name of a global without its module
};
using PickleTokens = std::vector<PickleToken>;

constexpr std::string_view kRebuildTensor = "_rebuild_tensor_v2";
constexpr unsigned char kText = 'X', kGlobal = 'c', kInteger = 'K', kMark = '(';
// The opcodes without operands: mark, empty tuple, tuples, dict, list; reduce, build, persistent id; None,
// True, False; and those that append to lists and set items of dictionaries.
constexpr std::string_view kPlain =
    "()t\x85\x86\x87}]RbQN\x88\x89"
    "aesu";

class PickleTokenizer {
 public:
  explicit PickleTokenizer(std::string_view bytes) : bytes_(bytes) {}

  PickleTokens run() {
    if (bytes_.size() > kMaxPickleBytes)
      throw Error("data.pkl is larger than 64 KiB, this is no gradient model");
    for (unsigned char opcode = read_byte(); opcode != '.'; opcode = read_byte()) read(opcode);
    return std::move(tokens_);
  }

 private:
  void read(unsigned char opcode) {
    switch (opcode) {
      case 0x80:
        if (const int protocol = read_byte(); protocol < 2 || protocol > 5)
          throw Error("pickle protocol is none of 2 to 5");
        break;
      case 0x95:  // a frame, which matters only when reading from a stream
        read_text(8);
        break;
      case 'K':
        return tokens_.push_back({kInteger, read_byte(), {}});
      case 'M':
        return tokens_.push_back({kInteger, read_little_endian(2), {}});
      case 'J':
        return tokens_.push_back({kInteger, static_cast<std::int32_t>(read_little_endian(4)), {}});
      case 'G':  // a double, big-endian
        read_text(8);
        return tokens_.push_back({opcode, 0, {}});
      case kText:
        return tokens_.push_back({kText, 0, read_text(read_little_endian(4))});
      case 0x8c:
        return tokens_.push_back({kText, 0, read_text(read_byte())});
      case kGlobal: {
        const std::string_view module = read_line();
        return add_global(module, read_line());
      }
      case 0x93: {  // a global, whose module and name are the last two texts
        const std::string_view name = take_text();
        return add_global(take_text(), name);
      }
      case 0x94:
        return remember(static_cast<std::uint32_t>(memo_.size()));
      case 'q':
        return remember(read_byte());
      case 'r':
        return remember(read_little_endian(4));
      case 'h':
        return recall(read_byte());
      case 'j':
        return recall(read_little_endian(4));
      default:
        if (kPlain.find(static_cast<char>(opcode)) == std::string_view::npos)
          throw Error(
              fmt::format("pickle instruction 0x{:02x} at byte {} is not one a state_dict needs; refused",
                          opcode, position_ - 1));
        tokens_.push_back({opcode, 0, {}});
    }
  }

  // Memoized values are recalled only for texts and globals.
  void remember(std::uint32_t slot) {
    if (tokens_.empty()) throw Error("data.pkl is damaged (empty stack)");
    memo_[slot] = tokens_.back();
  }

  void recall(std::uint32_t slot) {
    const auto found = memo_.find(slot);
    if (found == memo_.end()) throw Error("data.pkl is damaged (unknown memo)");
    const bool repeats = found->second.opcode == kText || found->second.opcode == kGlobal;
    tokens_.push_back(repeats ? found->second : PickleToken{'h', 0, {}});
  }

  void add_global(std::string_view module, std::string_view name) {
    if (!(module == "collections" && name == "OrderedDict") &&
        !(module == "torch._utils" && name == kRebuildTensor) &&
        !(module == "torch" && name.ends_with("Storage")))
      throw Error("it asks to load '" + (std::string(module) + "." + std::string(name)).substr(0, 80) +
                  "', which a gradient model does not need; refused");
    tokens_.push_back({kGlobal, 0, name});
  }

  std::string_view take_text() {
    if (tokens_.empty() || tokens_.back().opcode != kText) throw Error("data.pkl is damaged (global)");
    const std::string_view text = tokens_.back().text;
    tokens_.pop_back();
    return text;
  }

  std::string_view read_line() {
    const std::size_t start = position_;
    while (read_byte() != '\n') {
    }
    return bytes_.substr(start, position_ - start - 1);
  }

  unsigned char read_byte() {
    if (position_ >= bytes_.size()) throw Error("data.pkl is truncated");
    return static_cast<unsigned char>(bytes_[position_++]);
  }

  std::uint32_t read_little_endian(int count) {
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i) value |= static_cast<std::uint32_t>(read_byte()) << (8 * i);
    return value;
  }

  std::string_view read_text(std::size_t length) {
    if (length > bytes_.size() - position_) throw Error("data.pkl is truncated");
    const std::string_view text = bytes_.substr(position_, length);
    position_ += length;
    return text;
  }

  std::string_view bytes_;
  std::size_t position_ = 0;
  PickleTokens tokens_;
  std::unordered_map<std::uint32_t, PickleToken> memo_;
};

// Reads the arguments of torch._utils._rebuild_tensor_v2 in their order:
// ((storage, class, key, device, elements), offset, size, stride, ...).
class TensorCall {
 public:
  explicit TensorCall(std::span<const PickleToken> tokens) : tokens_(tokens) {}

  TensorEntry read(std::string_view name) {
    TensorEntry entry;
    entry.name = name;
    take(kMark);
    take(kMark);
    if (take(kText).text != "storage") refuse();
    entry.storage_class = take(kGlobal).text;
    entry.storage_key = take(kText).text;
    take(kText);
    entry.storage_elements = take(kInteger).integer;
    take('t');
    take('Q');
    entry.storage_offset = take(kInteger).integer;
    entry.shape = take_sizes();
    entry.stride = take_sizes();
    if (entry.stride.size() != entry.shape.size()) refuse();
    return entry;
  }

 private:
  [[noreturn]] static void refuse() { throw Error("data.pkl is damaged (tensor description)"); }

  bool next_is(unsigned char opcode) const { return !tokens_.empty() && tokens_.front().opcode == opcode; }

  const PickleToken& take(unsigned char opcode) {
    if (!next_is(opcode)) refuse();
    const PickleToken& token = tokens_.front();
    tokens_ = tokens_.subspan(1);
    return token;
  }

  std::vector<std::int64_t> take_sizes() {
    constexpr std::size_t most = 8;
    std::vector<std::int64_t> sizes;
    const bool marked = next_is(kMark);
    if (marked) take(kMark);
    while (next_is(kInteger) && sizes.size() < most) sizes.push_back(take(kInteger).integer);
    constexpr unsigned char closing[] = {')', 0x85, 0x86, 0x87};
    if (!marked && sizes.size() > 3) refuse();
    take(marked ? static_cast<unsigned char>('t') : closing[sizes.size()]);
    return sizes;
  }

  std::span<const PickleToken> tokens_;
};

// Returns the instructions that belong to the state_dict of a checkpoint, or all if there is only a
// state_dict.
std::span<const PickleToken> state_dict_of(std::span<const PickleToken> tokens) {
  const auto entry = std::ranges::find_if(tokens, [](const PickleToken& token) {
    return token.opcode == kText && (token.text == "state_dict" || token.text == "model_state_dict");
  });
  const auto first =
      std::find_if(entry, tokens.end(), [](const PickleToken& token) { return token.opcode == kMark; });
  if (first == tokens.end()) return tokens;
  auto last = first;
  for (int open = 0; last != tokens.end(); ++last) {
    open += last->opcode == kMark;
    open -= last->opcode == 't' || last->opcode == 'u' || last->opcode == 'e';
    if (open == 0) break;
  }
  return {first, last};
}

}  // namespace

std::vector<TensorEntry> read_state_dict_pickle(std::string_view pickle) {
  const PickleTokens all = PickleTokenizer(pickle).run();
  const std::span<const PickleToken> tokens = state_dict_of(all);
  std::vector<TensorEntry> tensors;
  for (std::size_t i = 1; i < tokens.size(); ++i)
    if (tokens[i].opcode == kGlobal && tokens[i].text == kRebuildTensor && tokens[i - 1].opcode == kText)
      tensors.push_back(TensorCall(tokens.subspan(i + 1)).read(tokens[i - 1].text));
  return tensors;
}

}  // namespace gelslam::surface::detail
