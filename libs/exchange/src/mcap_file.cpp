#include "mcap_file.hpp"

#include <array>

#include "gelslam/core/crc32.hpp"
#include "gelslam/core/error.hpp"

namespace gelslam::exchange::detail {
namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr std::size_t kChunkBytes = 1 << 20;  // Readers load whole chunks into memory.

enum Opcode : std::uint8_t {
  header = 1,
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  message_index = 7,
  chunk_index = 8,
  statistics = 11,
  summary_offset = 14,
  data_end = 15,
};

template <typename Number>
std::string number(Number value) {
  std::string bytes;
  for (std::size_t i = 0; i < sizeof(Number); ++i) bytes += static_cast<char>(value >> (8 * i) & 0xFFU);
  return bytes;
}

/// Returns bytes preceded by their length, as strings, arrays and maps are stored.
std::string counted_bytes(std::string_view bytes) {
  return number(static_cast<std::uint32_t>(bytes.size())).append(bytes);
}

std::string record_head(Opcode opcode, std::size_t length) {
  return static_cast<char>(opcode) + number(static_cast<std::uint64_t>(length));
}

std::string record(Opcode opcode, std::string_view content) {
  return record_head(opcode, content.size()).append(content);
}

template <typename Map>
std::string map_bytes(const Map& map) {
  std::string bytes;
  for (const auto& [key, value] : map) bytes += number(key) + number(value);
  return counted_bytes(bytes);
}

}  // namespace

McapFile::McapFile(const std::filesystem::path& path)
    : path_(path), temporary_(path), stream_(temporary_.path(), std::ios::binary) {
  put(kMagic);
  put(record(Opcode::header, counted_bytes("") + counted_bytes("GelSLAM")));
}

void McapFile::put(std::string_view bytes) {
  stream_.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
  if (!stream_) throw Error(path_.string() + ": cannot be written; is the disk full?");
  offset_ += bytes.size();
  crc_ = crc32_of(bytes, crc_);
}

std::uint16_t McapFile::add_channel(const std::string& topic, const std::string& schema_name,
                                    const std::string& schema) {
  const auto next = static_cast<std::uint16_t>(schema_ids_.size() + 1);
  const auto [place, is_new] = schema_ids_.emplace(schema_name, next);
  if (is_new) {
    const std::string bytes = record(Opcode::schema, number(next) + counted_bytes(schema_name) +
                                                         counted_bytes("jsonschema") + counted_bytes(schema));
    put(bytes);
    schemas_ += bytes;
  }
  const auto id = static_cast<std::uint16_t>(counts_.size() + 1);
  const std::string bytes =
      record(Opcode::channel, number(id) + number(place->second) + counted_bytes(topic) +
                                  counted_bytes("json") + counted_bytes(""));
  put(bytes);
  channels_ += bytes;
  counts_[id] = 0;
  return id;
}

void McapFile::write(std::uint16_t channel, std::uint64_t time_ns, std::string_view json) {
  chunk_entries_[channel].emplace_back(time_ns, chunk_.size());
  const auto sequence = static_cast<std::uint32_t>(counts_.at(channel)++);
  const std::string head = number(channel) + number(sequence) + number(time_ns) + number(time_ns);
  chunk_ += record_head(Opcode::message, head.size() + json.size());
  chunk_ += head;
  chunk_ += json;
  chunk_span_.add(time_ns);
  span_.add(time_ns);
  if (chunk_.size() >= kChunkBytes) end_chunk();
}

void McapFile::end_chunk() {
  if (chunk_.empty()) return;
  const std::uint64_t start = offset_, size = chunk_.size();
  const std::string times = number(chunk_span_.start) + number(chunk_span_.end);
  const std::string head = times + number(size) + number(crc32_of(chunk_)) + counted_bytes("") + number(size);
  put(record_head(Opcode::chunk, head.size() + chunk_.size()));
  put(head);
  put(chunk_);
  const std::uint64_t indexes = offset_;
  std::map<std::uint16_t, std::uint64_t> index_offsets;
  for (auto& [channel, entries] : chunk_entries_) {
    std::stable_sort(entries.begin(), entries.end());
    index_offsets[channel] = offset_;
    put(record(Opcode::message_index, number(channel) + map_bytes(entries)));
  }
  chunk_indexes_ += record(Opcode::chunk_index, times + number(start) + number(indexes - start) +
                                                    map_bytes(index_offsets) + number(offset_ - indexes) +
                                                    counted_bytes("") + number(size) + number(size));
  ++chunks_;
  chunk_.clear();
  chunk_entries_.clear();
  chunk_span_ = {};
}

std::string McapFile::statistics() const {
  std::uint64_t messages = 0;
  for (const auto& [channel, count] : counts_) messages += count;
  const std::uint32_t none = 0;
  return record(Opcode::statistics,
                number(messages) + number(static_cast<std::uint16_t>(schema_ids_.size())) +
                    number(static_cast<std::uint32_t>(counts_.size())) + number(none) + number(none) +
                    number(chunks_) + number(messages > 0 ? span_.start : std::uint64_t{0}) +
                    number(span_.end) + map_bytes(counts_));
}

/// Writes the summary: schemas, channels, chunk indexes and statistics again, the position of each of these
/// groups, and the footer.
void McapFile::write_summary() {
  const std::uint64_t start = offset_;
  crc_ = 0;
  std::string offsets;
  const std::string figures = statistics();
  for (const auto& [opcode, records] :
       std::array<std::pair<Opcode, const std::string*>, 4>{{{Opcode::schema, &schemas_},
                                                             {Opcode::channel, &channels_},
                                                             {Opcode::chunk_index, &chunk_indexes_},
                                                             {Opcode::statistics, &figures}}}) {
    if (records->empty()) continue;
    offsets += record(Opcode::summary_offset, static_cast<char>(opcode) + number(offset_) +
                                                  number(static_cast<std::uint64_t>(records->size())));
    put(*records);
  }
  const std::uint64_t offsets_start = offset_;
  put(offsets);
  const std::string places = number(start) + number(offsets_start);
  put(record_head(Opcode::footer, places.size() + 4) + places);
  put(number(crc_));
}

void McapFile::finish() {
  end_chunk();
  put(record(Opcode::data_end, number(crc_)));
  write_summary();
  put(kMagic);
  stream_.close();
  if (!stream_) throw Error(path_.string() + ": cannot be written; is the disk full?");
  temporary_.commit();
}

}  // namespace gelslam::exchange::detail
