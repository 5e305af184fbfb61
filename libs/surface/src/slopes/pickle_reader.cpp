#include "slopes/pickle_reader.hpp"

#include <fmt/core.h>

#include <string_view>
#include <unordered_map>

#include "gelslam/core/error.hpp"

namespace gelslam::surface::detail {
namespace {

// Opcodes of protocol 2 that torch.save writes for a state_dict; no others exist for this reader.
enum Opcode : unsigned char {
  op_proto = 0x80,
  op_global = 'c',
  op_reduce = 'R',
  op_build = 'b',
  op_persistent_id = 'Q',
  op_stop = '.',
  op_mark = '(',
  op_empty_tuple = ')',
  op_tuple = 't',
  op_tuple1 = 0x85,
  op_tuple2 = 0x86,
  op_tuple3 = 0x87,
  op_empty_dict = '}',
  op_set_item = 's',
  op_set_items = 'u',
  op_none = 'N',
  op_true = 0x88,
  op_false = 0x89,
  op_int1 = 'K',
  op_int2 = 'M',
  op_int4 = 'J',
  op_unicode = 'X',
  op_float = 'G',
  op_empty_list = ']',
  op_append = 'a',
  op_appends = 'e',
  op_put1 = 'q',
  op_put4 = 'r',
  op_get1 = 'h',
  op_get4 = 'j'
};

enum class Kind {
  mark,
  none,
  boolean,
  number,  // not read
  integer,
  text,
  tuple,
  list,
  dict,
  ordered_dict_class,
  rebuild_tensor,
  storage_class,
  storage,
  tensor
};

// Nodes live in one arena and refer to each other by index: shared or even cyclic input can neither grow by
// copying nor recurse on destruction.
using NodeId = std::uint32_t;
struct Node {
  Kind kind;
  std::int64_t integer = 0;
  std::string_view text;
  // tuple, list: items; dict: key, value, key, value...; storage, tensor: the one tuple of their arguments,
  // which many of them may share
  std::vector<NodeId> children;
};

constexpr std::size_t kMaxTensors = 256, kMaxDimensions = 8;

class PickleMachine {
 public:
  explicit PickleMachine(std::span<const unsigned char> bytes) : bytes_(bytes) {}

  std::vector<TensorEntry> run() {
    if (bytes_.size() > kMaxEntryBytes)
      throw Error("data.pkl is larger than 64 KiB, this is no gradient model");
    while (step()) {
    }
    return collect_tensors(state_dict_of(pop(Kind::dict, "a dictionary at the end")));
  }

 private:
  // One instruction; false at STOP.
  bool step() {
    const unsigned char opcode = read_byte();
    if (opcode == op_stop) return false;
    if (opcode == op_proto)
      check_protocol(read_byte());
    else if (!push_plain(opcode) && !build(opcode) && !use_memo(opcode))
      refuse_opcode(opcode);
    return true;
  }

  static void check_protocol(unsigned char protocol) {
    if (protocol != 2) throw Error("pickle protocol is not 2");
  }

  // Each of these three is false for the instructions of the others.

  bool push_plain(unsigned char opcode) {
    switch (opcode) {
      case op_mark:
        push({Kind::mark, 0, {}, {}});
        return true;
      case op_empty_tuple:
        push({Kind::tuple, 0, {}, {}});
        return true;
      case op_empty_dict:
        push({Kind::dict, 0, {}, {}});
        return true;
      case op_empty_list:
        push({Kind::list, 0, {}, {}});
        return true;
      case op_float:
        read_text(8);
        push({Kind::number, 0, {}, {}});
        return true;
      case op_none:
        push({Kind::none, 0, {}, {}});
        return true;
      case op_true:
        push({Kind::boolean, 1, {}, {}});
        return true;
      case op_false:
        push({Kind::boolean, 0, {}, {}});
        return true;
      case op_int1:
        push({Kind::integer, read_byte(), {}, {}});
        return true;
      case op_int2:
        push({Kind::integer, read_little_endian(2), {}, {}});
        return true;
      case op_int4:
        push({Kind::integer, static_cast<std::int32_t>(read_little_endian(4)), {}, {}});
        return true;
      case op_unicode:
        push({Kind::text, 0, read_text(read_little_endian(4)), {}});
        return true;
      default:
        return false;
    }
  }

  // Out of what is on the stack.
  bool build(unsigned char opcode) {
    switch (opcode) {
      case op_global:
        push_global();
        return true;
      case op_reduce:
        reduce();
        return true;
      case op_build:  // sets attributes (torch puts version numbers there); nothing of it is needed
        pop(Kind::dict, "a dictionary as state");
        peek(Kind::dict, "a dictionary to set state on");
        return true;
      case op_persistent_id:
        push_storage();
        return true;
      case op_tuple:
        push({Kind::tuple, 0, {}, pop_to_mark()});
        return true;
      case op_tuple1:
      case op_tuple2:
      case op_tuple3:
        push_tuple(opcode - op_tuple1 + 1U);
        return true;
      case op_append:
        append(pop_items(1));
        return true;
      case op_appends:
        append(pop_to_mark());
        return true;
      case op_set_item:
        set_items(pop_items(2));
        return true;
      case op_set_items:
        set_items(pop_to_mark());
        return true;
      default:
        return false;
    }
  }

  bool use_memo(unsigned char opcode) {
    switch (opcode) {
      case op_put1:
        memo_[read_byte()] = peek_id();
        return true;
      case op_put4:
        memo_[read_little_endian(4)] = peek_id();
        return true;
      case op_get1:
        recall(read_byte());
        return true;
      case op_get4:
        recall(read_little_endian(4));
        return true;
      default:
        return false;
    }
  }

  [[noreturn]] void refuse_opcode(unsigned char opcode) const {
    throw Error(fmt::format("pickle instruction 0x{:02x} at byte {} is not one a state_dict needs; refused",
                            opcode, position_ - 1));
  }

  unsigned char read_byte() {
    if (position_ >= bytes_.size()) throw Error("data.pkl is truncated");
    return bytes_[position_++];
  }

  std::uint32_t read_little_endian(int count) {
    std::uint32_t value = 0;
    for (int i = 0; i < count; ++i) value |= static_cast<std::uint32_t>(read_byte()) << (8 * i);
    return value;
  }

  std::string_view read_text(std::size_t length) {
    if (length > bytes_.size() - position_) throw Error("data.pkl is truncated");
    const std::string_view text(reinterpret_cast<const char*>(bytes_.data()) + position_, length);
    position_ += length;
    return text;
  }

  std::string_view read_line() {
    const std::size_t start = position_;
    while (read_byte() != '\n') {
    }
    return {reinterpret_cast<const char*>(bytes_.data()) + start, position_ - start - 1};
  }

  void push(Node node) {
    arena_.push_back(std::move(node));
    stack_.push_back(static_cast<NodeId>(arena_.size() - 1));
  }

  NodeId peek_id() const {
    if (stack_.empty()) throw Error("data.pkl is damaged (empty stack)");
    return stack_.back();
  }

  Node& peek(Kind kind, const char* expected) {
    Node& node = arena_[peek_id()];
    if (node.kind != kind) throw Error(std::string("data.pkl is damaged (expected ") + expected + ")");
    return node;
  }

  NodeId pop(Kind kind, const char* expected) {
    peek(kind, expected);
    const NodeId id = stack_.back();
    stack_.pop_back();
    return id;
  }

  std::vector<NodeId> pop_items(std::size_t count) {
    if (stack_.size() < count) throw Error("data.pkl is damaged (empty stack)");
    std::vector<NodeId> items(stack_.end() - static_cast<std::ptrdiff_t>(count), stack_.end());
    stack_.resize(stack_.size() - count);
    return items;
  }

  std::vector<NodeId> pop_to_mark() {
    std::size_t first = stack_.size();
    while (first > 0 && arena_[stack_[first - 1]].kind != Kind::mark) --first;
    if (first == 0) throw Error("data.pkl is damaged (no mark)");
    std::vector<NodeId> items = pop_items(stack_.size() - first);
    stack_.pop_back();
    return items;
  }

  void push_tuple(std::size_t count) { push({Kind::tuple, 0, {}, pop_items(count)}); }

  void set_items(const std::vector<NodeId>& items) {
    if (items.size() % 2 != 0) throw Error("data.pkl is damaged (a key without a value)");
    auto& children = peek(Kind::dict, "a dictionary").children;
    children.insert(children.end(), items.begin(), items.end());
  }

  void append(const std::vector<NodeId>& items) {
    auto& children = peek(Kind::list, "a list").children;
    children.insert(children.end(), items.begin(), items.end());
  }

  void recall(std::uint32_t slot) {
    const auto found = memo_.find(slot);
    if (found == memo_.end()) throw Error("data.pkl is damaged (unknown memo)");
    stack_.push_back(found->second);
  }

  void push_global() {
    const std::string_view module = read_line();
    const std::string_view name = read_line();
    const std::string global = std::string(module) + "." + std::string(name);
    if (global == "collections.OrderedDict") {
      push({Kind::ordered_dict_class, 0, {}, {}});
    } else if (global == "torch._utils._rebuild_tensor_v2") {
      push({Kind::rebuild_tensor, 0, {}, {}});
    } else if (module == "torch" && name.ends_with("Storage")) {
      push({Kind::storage_class, 0, name, {}});
    } else {
      throw Error("it asks to load '" + printable(global) +
                  "', which a gradient model does not need; refused");
    }
  }

  void reduce() {
    const NodeId arguments = pop(Kind::tuple, "arguments");
    const std::vector<NodeId> callee = pop_items(1);
    switch (arena_[callee[0]].kind) {
      case Kind::ordered_dict_class:
        if (!arena_[arguments].children.empty())
          throw Error("data.pkl is damaged (OrderedDict with arguments)");
        push({Kind::dict, 0, {}, {}});
        break;
      case Kind::rebuild_tensor:
        push({Kind::tensor, 0, {}, {arguments}});
        break;
      default:
        throw Error("data.pkl is damaged (call of something that is no function)");
    }
  }

  void push_storage() {
    const NodeId id = pop(Kind::tuple, "a storage description");
    const std::vector<NodeId>& fields =
        arena_[id].children;  // 'storage', class, key, device, number of elements
    if (fields.size() != 5 || arena_[fields[0]].text != "storage" ||
        arena_[fields[1]].kind != Kind::storage_class || arena_[fields[2]].kind != Kind::text ||
        arena_[fields[4]].kind != Kind::integer) {
      throw Error("data.pkl is damaged (storage description)");
    }
    push({Kind::storage, 0, {}, {id}});
  }

  // A result has at most kMaxTensors of these, and many may name one tuple: hence the bound.
  std::vector<std::int64_t> integers(NodeId id) const {
    const Node& node = arena_[id];
    if (node.kind != Kind::tuple || node.children.size() > kMaxDimensions)
      throw Error("data.pkl is damaged (tensor size)");
    std::vector<std::int64_t> values;
    for (const NodeId child : node.children) {
      if (arena_[child].kind != Kind::integer) throw Error("data.pkl is damaged (tensor size)");
      values.push_back(arena_[child].integer);
    }
    return values;
  }

  TensorEntry tensor_entry(std::string_view name, const Node& tensor) const {
    const auto& arguments =
        arena_[tensor.children[0]].children;  // storage, offset, size, stride, requires_grad, hooks
    if (arguments.size() < 4 || arena_[arguments[0]].kind != Kind::storage ||
        arena_[arguments[1]].kind != Kind::integer) {
      throw Error("data.pkl is damaged (tensor description)");
    }
    const auto& storage = arena_[arena_[arguments[0]].children[0]].children;
    TensorEntry entry;
    entry.name = name;
    entry.storage_class = arena_[storage[1]].text;
    entry.storage_key = arena_[storage[2]].text;
    entry.storage_elements = arena_[storage[4]].integer;
    entry.storage_offset = arena_[arguments[1]].integer;
    entry.shape = integers(arguments[2]);
    entry.stride = integers(arguments[3]);
    if (entry.stride.size() != entry.shape.size()) throw Error("data.pkl is damaged (tensor stride)");
    return entry;
  }

  // Of a checkpoint its entry with the state_dict, else the dictionary itself.
  NodeId state_dict_of(NodeId dict) const {
    const auto& children = arena_[dict].children;
    for (std::size_t i = 0; i + 1 < children.size(); i += 2) {
      const Node &key = arena_[children[i]], &value = arena_[children[i + 1]];
      if (key.kind != Kind::text || value.kind != Kind::dict) continue;
      if (key.text == "state_dict" || key.text == "model_state_dict") return children[i + 1];
    }
    return dict;
  }

  std::vector<TensorEntry> collect_tensors(NodeId dict) const {
    const auto& children = arena_[dict].children;
    if (children.size() > 2 * kMaxTensors) throw Error("it holds too many tensors for a gradient model");
    std::vector<TensorEntry> tensors;
    for (std::size_t i = 0; i + 1 < children.size(); i += 2) {
      const Node& key = arena_[children[i]];
      const Node& value = arena_[children[i + 1]];
      if (key.kind != Kind::text || value.kind != Kind::tensor) {
        throw Error("it is not a state_dict (a dictionary of named tensors)");
      }
      tensors.push_back(tensor_entry(key.text, value));
    }
    return tensors;
  }

  std::span<const unsigned char> bytes_;
  std::size_t position_ = 0;
  std::vector<Node> arena_;
  std::vector<NodeId> stack_;
  std::unordered_map<std::uint32_t, NodeId> memo_;
};

}  // namespace

std::string printable(const std::string& text) {
  std::string result = text.substr(0, 80);
  for (char& c : result) {
    if (c < ' ' || c > '~') c = '?';
  }
  return result;
}

std::vector<TensorEntry> read_state_dict_pickle(std::span<const unsigned char> pickle) {
  return PickleMachine(pickle).run();
}

}  // namespace gelslam::surface::detail
