#include "logs/matroska_header.hpp"

#include <fmt/core.h>

#include <bit>
#include <cassert>
#include <cmath>

namespace gelslam::detail {
namespace {

std::string last_bytes(std::uint64_t value, int count) {
  std::string bytes;
  for (int shift = 8 * (count - 1); shift >= 0; shift -= 8)
    bytes += static_cast<char>((value >> shift) & 0xff);
  return bytes;
}

/// Encodes a length: each byte contributes seven bits, and all ones mean "unknown".
std::string shortest_length(std::uint64_t length) {
  int count = 1;
  while (length >= (std::uint64_t{1} << (7 * count)) - 1) ++count;
  return last_bytes(length | (std::uint64_t{1} << (7 * count)), count);
}

// EBML (RFC 8794) is the syntax of Matroska: an element has an id, a length and a payload. Ids are given with
// their length marker, as in the specifications.

/// Returns id and length of an element whose payload is written separately.
std::string ebml_head(std::uint32_t id, std::uint64_t payload_bytes) {
  const int id_bytes = (std::bit_width(id) + 7) / 8;
  return last_bytes(id, id_bytes) + shortest_length(payload_bytes);
}

std::string ebml_element(std::uint32_t id, std::string_view payload) {
  std::string element = ebml_head(id, payload.size());
  element += payload;
  return element;
}

std::string ebml_number(std::uint32_t id, std::uint64_t value) {
  return ebml_element(id, last_bytes(value, 8));
}

/// Returns an element that reserves `total_bytes` (2 to 128).
std::string ebml_void(std::size_t total_bytes) {
  constexpr std::uint32_t void_id = 0xec;
  assert(total_bytes >= 2 && total_bytes <= 128);
  return ebml_element(void_id, std::string(total_bytes - 2, '\0'));
}

// Ids of RFC 9559 (Matroska) with its names.
namespace id {
constexpr std::uint32_t kEbml = 0x1a45dfa3, kEbmlVersion = 0x4286, kEbmlReadVersion = 0x42f7,
                        kEbmlMaxId = 0x42f2, kEbmlMaxSize = 0x42f3, kDocType = 0x4282,
                        kDocTypeVersion = 0x4287, kDocTypeReadVersion = 0x4285, kSegment = 0x18538067;
constexpr std::uint32_t kInfo = 0x1549a966, kTimestampScale = 0x2ad7b1, kDuration = 0x4489, kDateUtc = 0x4461,
                        kMuxingApp = 0x4d80, kWritingApp = 0x5741;
constexpr std::uint32_t kTracks = 0x1654ae6b, kTrackEntry = 0xae, kTrackNumber = 0xd7, kTrackUid = 0x73c5,
                        kTrackType = 0x83, kFlagLacing = 0x9c, kDefaultDuration = 0x23e383,
                        kMaxBlockAddition = 0x55ee, kCodecId = 0x86, kCodecPrivate = 0x63a2, kVideo = 0xe0,
                        kPixelWidth = 0xb0, kPixelHeight = 0xba, kColorSpace = 0x2eb524;
constexpr std::uint32_t kTags = 0x1254c367, kTag = 0x7373, kTargets = 0x63c0, kSimpleTag = 0x67c8,
                        kTagName = 0x45a3, kTagString = 0x4487;
constexpr std::uint32_t kAttachments = 0x1941a469, kAttachedFile = 0x61a7, kFileName = 0x466e,
                        kFileMediaType = 0x4660, kFileUid = 0x46ae, kFileData = 0x465c;
constexpr std::uint32_t kCluster = 0x1f43b675, kTimestamp = 0xe7, kBlockGroup = 0xa0, kBlock = 0xa1,
                        kBlockAdditions = 0x75a1, kBlockMore = 0xa6, kBlockAdditional = 0xa5;
}  // namespace id

std::string file_type() {
  return ebml_element(id::kEbml, ebml_number(id::kEbmlVersion, 1) + ebml_number(id::kEbmlReadVersion, 1) +
                                     ebml_number(id::kEbmlMaxId, 4) + ebml_number(id::kEbmlMaxSize, 8) +
                                     ebml_element(id::kDocType, "matroska") +
                                     ebml_number(id::kDocTypeVersion, 4) +
                                     ebml_number(id::kDocTypeReadVersion, 2));
}

std::string date(std::int64_t unix_us) {
  constexpr std::int64_t matroska_epoch_us = 978'307'200'000'000;  // 2001-01-01
  return ebml_number(id::kDateUtc, static_cast<std::uint64_t>((unix_us - matroska_epoch_us) * 1000));
}

std::string little_endian(std::uint32_t value, int bytes) {
  std::string text;
  for (int i = 0; i < bytes; ++i) text += static_cast<char>((value >> (8 * i)) & 0xff);
  return text;
}

/// Matroska has no codec name for PNG; players recognize it by the header that AVI files have
/// (BITMAPINFOHEADER).
std::string png_codec(const MatroskaTrack& track) {
  const std::uint32_t width = static_cast<std::uint32_t>(track.width_px),
                      height = static_cast<std::uint32_t>(track.height_px);
  const std::string bitmap_header = little_endian(40, 4) + little_endian(width, 4) +
                                    little_endian(height, 4) + little_endian(1, 2) + little_endian(24, 2) +
                                    "MPNG" + little_endian(3 * width * height, 4) + std::string(16, '\0');
  return ebml_element(id::kCodecId, "V_MS/VFW/FOURCC") + ebml_element(id::kCodecPrivate, bitmap_header);
}

std::string track_entry(const MatroskaTrack& track) {
  std::string codec, color_space;
  if (track.encoding == FrameEncoding::jpeg) codec = ebml_element(id::kCodecId, "V_MJPEG");
  if (track.encoding == FrameEncoding::png) codec = png_codec(track);
  if (track.encoding == FrameEncoding::yuyv) {
    codec = ebml_element(id::kCodecId, "V_UNCOMPRESSED");
    color_space = ebml_element(id::kColorSpace, "YUY2");
  }
  const std::string video = ebml_number(id::kPixelWidth, static_cast<std::uint64_t>(track.width_px)) +
                            ebml_number(id::kPixelHeight, static_cast<std::uint64_t>(track.height_px)) +
                            color_space;
  constexpr std::uint64_t is_video = 1, number = 1;
  const auto frame_ns = static_cast<std::uint64_t>(std::llround(1e9 / track.rate_hz));
  return ebml_element(id::kTrackEntry,
                      ebml_number(id::kTrackNumber, number) + ebml_number(id::kTrackUid, number) +
                          ebml_number(id::kTrackType, is_video) + ebml_number(id::kFlagLacing, 0) +
                          ebml_number(id::kDefaultDuration, frame_ns) +
                          ebml_number(id::kMaxBlockAddition, 1) + codec + ebml_element(id::kVideo, video));
}

std::string tag_list(std::string_view name, std::string_view value) {
  return ebml_element(
      id::kTags,
      ebml_element(id::kTag, ebml_element(id::kTargets, "") +
                                 ebml_element(id::kSimpleTag, ebml_element(id::kTagName, name) +
                                                                  ebml_element(id::kTagString, value))));
}

std::string attached_file(std::uint64_t uid, std::string_view name, std::string_view media_type,
                          std::string_view data) {
  if (data.empty()) return "";
  return ebml_element(id::kAttachedFile,
                      ebml_element(id::kFileName, name) + ebml_element(id::kFileMediaType, media_type) +
                          ebml_number(id::kFileUid, uid) + ebml_element(id::kFileData, data));
}

std::string attachment_list(const LogAttachments& stored) {
  const std::string files = attached_file(1, kConfigAttachment, "text/plain", stored.config_yaml) +
                            attached_file(2, kModelAttachment, "application/zip", stored.model);
  return files.empty() ? "" : ebml_element(id::kAttachments, files);
}

}  // namespace

std::string ebml_length_8(std::uint64_t payload_bytes) {
  return last_bytes(payload_bytes | (std::uint64_t{1} << 56), 8);
}

std::string duration_element(std::uint64_t ticks) {
  return ebml_number(id::kDuration, std::bit_cast<std::uint64_t>(static_cast<double>(ticks)));
}

std::string frames_element(std::int64_t frames) {
  return tag_list(kFramesTag, fmt::format("{:012}", frames));
}

MatroskaHeader matroska_header(const LogAttachments& stored, const MatroskaTrack& track,
                               std::int64_t now_unix_us, std::int64_t start_unix_us) {
  MatroskaHeader header;
  std::string& bytes = header.bytes;
  bytes = file_type() + ebml_head(id::kSegment, 0);
  bytes.pop_back();  // Removes the length of one byte.
  header.segment_length_at = bytes.size();
  bytes += last_bytes(0x01ffffffffffffff, 8);  // The length is unknown until close().
  header.segment_begins_at = bytes.size();

  const std::string space_for_duration = ebml_void(duration_element(0).size());
  const std::string info = ebml_number(id::kTimestampScale, kMatroskaTickNs) + date(now_unix_us) +
                           ebml_element(id::kMuxingApp, kLogApplication) +
                           ebml_element(id::kWritingApp, kLogApplication);
  bytes += ebml_element(id::kInfo, info + space_for_duration);
  header.duration_at = bytes.size() - space_for_duration.size();
  bytes += ebml_element(id::kTracks, track_entry(track));
  if (!stored.sensor.empty()) bytes += tag_list(kSensorTag, stored.sensor);
  if (!stored.camera_settings.empty()) bytes += tag_list(kSettingsTag, stored.camera_settings);
  if (start_unix_us != 0) bytes += tag_list(kStartTag, std::to_string(start_unix_us));
  header.frames_at = bytes.size();
  bytes += ebml_void(frames_element(0).size());
  bytes += attachment_list(stored);
  return header;
}

std::string cluster_head(std::uint64_t ticks, std::uint64_t sequence, std::size_t data_bytes) {
  const std::string additions =
      ebml_element(id::kBlockAdditions,
                   ebml_element(id::kBlockMore, ebml_element(id::kBlockAdditional, last_bytes(sequence, 8))));
  // Track number (encoded like a length), time relative to the cluster (0), no lacing.
  const std::string block_prefix = shortest_length(1) + std::string(3, '\0');
  const std::string block = ebml_head(id::kBlock, block_prefix.size() + data_bytes) + block_prefix;
  const std::string group =
      ebml_head(id::kBlockGroup, additions.size() + block.size() + data_bytes) + additions + block;
  const std::string time = ebml_number(id::kTimestamp, ticks);
  return ebml_head(id::kCluster, time.size() + group.size() + data_bytes) + time + group;
}

}  // namespace gelslam::detail
