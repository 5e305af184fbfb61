#pragma once

#include <algorithm>
#include <cstdint>
#include <fstream>
#include <map>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "gelslam/core/files.hpp"

namespace gelslam::exchange::detail {

/// Writes an MCAP file of JSON messages in uncompressed chunks, with message indexes, a summary and
/// checksums. Source: https://mcap.dev/spec (version 0).
class McapFile {
 public:
  explicit McapFile(const std::filesystem::path& path);

  /// Returns the id of a new channel. `schema` is a JSON schema, which is shared by all channels with the
  /// same schema name.
  std::uint16_t add_channel(const std::string& topic, const std::string& schema_name,
                            const std::string& schema);
  /// Writes a message at `time_ns` since the log's first frame. The order of messages is free; files ordered
  /// by time are the fastest to read.
  void write(std::uint16_t channel, std::uint64_t time_ns, std::string_view json);
  /// Writes the rest of the file, which then appears under its name. Throws Error when the disk is full.
  void finish();

 private:
  using Entry = std::pair<std::uint64_t, std::uint64_t>;
  struct Span {
    std::uint64_t start = ~std::uint64_t{0}, end = 0;
    void add(std::uint64_t time_ns) {
      start = std::min(start, time_ns);
      end = std::max(end, time_ns);
    }
  };
  void put(std::string_view bytes);
  void end_chunk();
  std::string statistics() const;
  void write_summary();

  std::filesystem::path path_;
  TemporaryFile temporary_;
  std::ofstream stream_;
  std::uint64_t offset_ = 0;
  std::uint32_t crc_ = 0;  ///< Checksum of everything since the beginning of the file or the summary.
  std::string schemas_, channels_, chunk_indexes_;  ///< Records that are repeated in the summary.
  std::map<std::string, std::uint16_t> schema_ids_;
  std::map<std::uint16_t, std::uint64_t> counts_;  ///< Number of messages per channel.
  std::uint32_t chunks_ = 0;
  Span span_;  ///< Time span of the file.
  std::string chunk_;
  Span chunk_span_;
  /// Time and offset in the chunk for each message of a channel.
  std::map<std::uint16_t, std::vector<Entry>> chunk_entries_;
};

}  // namespace gelslam::exchange::detail
