#include "gelslam/core/zip_archive.hpp"

#include <zip.h>

#include <memory>

#include "gelslam/core/error.hpp"
#include "gelslam/core/files.hpp"

namespace gelslam {
namespace {

struct Discard {
  void operator()(zip_t* archive) const { zip_discard(archive); }
  void operator()(zip_file_t* entry) const { zip_fclose(entry); }
};
using Archive = std::unique_ptr<zip_t, Discard>;

Archive open_archive(std::string_view bytes) {
  zip_error_t error;
  zip_error_init(&error);
  zip_source_t* source = zip_source_buffer_create(bytes.data(), bytes.size(), 0, &error);
  zip_t* archive = source == nullptr ? nullptr : zip_open_from_source(source, ZIP_RDONLY, &error);
  if (archive == nullptr) zip_source_free(source);
  zip_error_fini(&error);
  return Archive(archive);
}

std::string read_entry(zip_t* archive, zip_uint64_t index, std::size_t max_bytes, const std::string& where) {
  zip_stat_t info;
  if (zip_stat_index(archive, index, 0, &info) != 0 || (info.valid & ZIP_STAT_SIZE) == 0)
    throw Error(where + " is damaged");
  if (info.size > max_bytes)
    throw Error(where + " holds more than expected (" + std::to_string(info.size) + " bytes)");
  const std::unique_ptr<zip_file_t, Discard> entry(zip_fopen_index(archive, index, 0));
  // One byte more, because libzip checks the CRC only when the end is reached.
  std::string bytes(info.size + 1, '\0');
  std::size_t size = 0;
  while (entry && size < bytes.size()) {
    const zip_int64_t count = zip_fread(entry.get(), bytes.data() + size, bytes.size() - size);
    if (count < 0) throw Error(where + " is damaged");
    if (count == 0) break;
    size += static_cast<std::size_t>(count);
  }
  if (size != info.size) throw Error(where + " is damaged");
  bytes.resize(size);
  return bytes;
}

void check(bool good, const std::filesystem::path& path) {
  if (!good) throw Error("cannot write '" + path.string() + "'; is the disk full?");
}

void add_entry(zip_t* archive, const ZipEntry& entry, const std::filesystem::path& path) {
  zip_source_t* source = zip_source_buffer(archive, entry.contents.data(), entry.contents.size(), 0);
  check(source != nullptr, path);
  const zip_int64_t added = zip_file_add(archive, entry.name.c_str(), source, ZIP_FL_ENC_UTF_8);
  if (added < 0) zip_source_free(source);
  check(added >= 0, path);
  const auto index = static_cast<zip_uint64_t>(added);
  constexpr zip_uint16_t first_of_1980 = 0x21;
  check(zip_set_file_compression(archive, index, ZIP_CM_STORE, 0) == 0, path);
  check(zip_file_set_dostime(archive, index, 0, first_of_1980, 0) == 0, path);
}

}  // namespace

std::vector<ZipEntry> parse_zip(std::string_view bytes, const std::string& name, const ZipLimits& limits) {
  const Archive archive = open_archive(bytes);
  if (!archive) throw Error(name + " is no zip archive, or truncated");
  const zip_int64_t count = zip_get_num_entries(archive.get(), 0);
  if (count < 0 || static_cast<std::size_t>(count) > limits.entries)
    throw Error(name + " holds " + std::to_string(count) + " files, more than expected");
  std::vector<ZipEntry> entries;
  for (zip_uint64_t i = 0; i < static_cast<zip_uint64_t>(count); ++i) {
    const char* entry = zip_get_name(archive.get(), i, ZIP_FL_ENC_RAW);
    if (entry == nullptr) throw Error(name + " is damaged");
    const std::string where = name + ": '" + entry + "'";
    entries.push_back({entry, read_entry(archive.get(), i, limits.entry_bytes, where)});
  }
  return entries;
}

void write_zip(const std::filesystem::path& path, const std::vector<ZipEntry>& entries) {
  TemporaryFile file(path);
  int error = 0;
  Archive archive(zip_open(file.path().c_str(), ZIP_CREATE | ZIP_TRUNCATE, &error));
  check(archive != nullptr, path);
  for (const ZipEntry& entry : entries) add_entry(archive.get(), entry, path);
  check(zip_close(archive.get()) == 0, path);
  static_cast<void>(archive.release());
  file.commit();
}

}  // namespace gelslam
