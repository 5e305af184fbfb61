#include <fmt/core.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <functional>
#include <map>
#include <numeric>
#include <optional>
#include <regex>
#include <set>
#include <utility>

#include "gelslam/core/error.hpp"
#include "gelslam/core/median.hpp"
#include "gelslam/core/text.hpp"
#include "gelslam/core/trajectory.hpp"
#include "images/sources.hpp"

namespace gelslam::detail {
namespace {

namespace fs = std::filesystem;

/// The images of a folder in order, with their times.
struct Series {
  std::vector<fs::path> images;
  std::string order = {};                ///< What the order was taken from, for the user.
  std::vector<std::int64_t> times_us{};  ///< Times from the names; empty if the names contain none.
  bool is_unix = false;                  ///< True if the times count from 1970.
  /// Frame numbers from 0, with gaps if numbers in the names are missing.
  std::vector<std::int64_t> numbers{};
  double rate_hz = 0;
  std::string warning = {};  ///< A sentence for the user, or "".

  double time_s(std::size_t i) const {
    return times_us.empty() ? static_cast<double>(numbers[i]) / rate_hz
                            : 1e-6 * static_cast<double>(times_us[i] - times_us.front());
  }
  std::string missing() const {
    const std::int64_t count = numbers.back() + 1 - std::ssize(numbers);
    return count > 0 ? ", " + counted(count, "number") + " left out" : "";
  }
};

/// An image of a folder, with the number or time in its name.
struct Entry {
  fs::path image;
  std::int64_t value = 0;   ///< The number, or the time in µs.
  std::string digits = {};  ///< Digits after the decimal point; all digits of a hexadecimal number.
};
using Entries = std::vector<Entry>;

/// A scheme of file names: a prefix, and a number or a time. Within a series the prefixes are equal except
/// for their digits.
struct Naming {
  enum class Kind { number, hexadecimal, time, unix_time };
  std::string words;
  Kind kind;
  /// Form of a name without its extension; the first group is the prefix, the last one the digits.
  std::regex form;
  /// Returns the value, or a negative number if the name contains none.
  std::int64_t (*value)(const std::smatch& parts);
  bool (*fits)(const Entries& entries);  ///< Says whether the images of a series may be named in this way.

  bool is_time() const { return kind == Kind::time || kind == Kind::unix_time; }
};

constexpr std::int64_t kSecondUs = 1'000'000;

std::int64_t number(const std::string& digits, int base = 10) {
  return digits.empty() ? 0 : std::stoll(digits, nullptr, base);
}

/// Converts the digits after a decimal point to microseconds.
std::int64_t fraction_us(const std::string& digits) { return number((digits + "000000").substr(0, 6)); }

/// Returns -1 for a time before 2001, as no log is older.
std::int64_t of_this_century(std::int64_t unix_us) {
  constexpr std::int64_t kFirstUs = 1'000'000'000 * kSecondUs;  // 2001
  return unix_us >= kFirstUs && unix_us < kMaxUnixUs ? unix_us : -1;
}

std::int64_t date_us(const std::smatch& parts) {
  using namespace std::chrono;
  const auto part = [&](std::size_t i) { return static_cast<int>(number(parts[i])); };
  const year_month_day date = year(part(2)) / part(3) / part(4);
  if (!date.ok() || part(2) < 1970 || part(5) > 23 || part(6) > 59 || part(7) > 59) return -1;
  const auto time = sys_days(date) + hours(part(5)) + minutes(part(6)) + seconds(part(7));
  return duration_cast<std::chrono::microseconds>(time.time_since_epoch()).count() + fraction_us(parts[8]);
}

bool have_as_many_digits(const Entries& entries) {
  return std::ranges::all_of(
      entries, [&](const Entry& entry) { return entry.digits.size() == entries.front().digits.size(); });
}

/// Says whether the names are seconds as programs print them: all with the same number of digits after the
/// point, or none with trailing zeros.
bool are_decimals(const Entries& entries) {
  const auto has_point = [](const Entry& entry) { return !entry.digits.empty(); };
  const auto ends_in_zero = [](const Entry& p) { return p.digits.size() > 1 && p.digits.ends_with('0'); };
  return 2 * std::ranges::count_if(entries, has_point) > std::ssize(entries) &&
         (have_as_many_digits(entries) || std::ranges::none_of(entries, ends_in_zero));
}

/// Says whether the names are hexadecimal rather than decimal numbers. Numbers padded with zeros all have the
/// same length. Without padding, the test is how many numbers are missing: decimal numbers read as
/// hexadecimal ones skip six of sixteen, while a counter may skip at most a fifth.
bool are_hexadecimal(const Entries& entries) {
  const auto padded = [](const Entry& p) { return p.digits.size() > 1 && p.digits.starts_with('0'); };
  const auto [first, last] = std::ranges::minmax(entries, {}, &Entry::value);
  return have_as_many_digits(entries) ||
         (std::ranges::none_of(entries, padded) && 4 * (last.value - first.value) < 5 * std::ssize(entries));
}

const std::vector<Naming>& namings() {
  using Kind = Naming::Kind;
  const auto always = [](const Entries&) { return true; };
  static const std::vector<Naming> known{
      {"the seconds and nanoseconds since 1970", Kind::unix_time,
       std::regex(R"((|.*?[^0-9])([0-9]{10})[._]([0-9]{1,9}))"),
       [](const std::smatch& parts) {
         return of_this_century(number(parts[2]) * kSecondUs + number(parts[3]) / 1000);
       },
       [](const Entries& entries) {
         return std::ranges::any_of(entries, [](const Entry& entry) { return entry.digits.size() == 9; });
       }},
      {"the seconds since 1970", Kind::unix_time, std::regex(R"((|.*?[^0-9])([0-9]{10})(?:\.([0-9]+))?)"),
       [](const std::smatch& parts) {
         return of_this_century(number(parts[2]) * kSecondUs + fraction_us(parts[3]));
       },
       always},
      {"the milli-, micro- or nanoseconds since 1970", Kind::unix_time,
       std::regex(R"((|.*?[^0-9])([0-9]{13}|[0-9]{16}|[0-9]{19}))"),
       [](const std::smatch& parts) {
         return of_this_century(number((parts[2].str() + "000").substr(0, 16)));
       },
       always},
      {"the date and time", Kind::time,  // The time zone of the clock is not known.
       std::regex(
           R"((|.*?[^0-9])([0-9]{4})[-_.]?([0-9]{2})[-_.]?([0-9]{2})[-_ T]?([0-9]{2})[-_:.]?)"
           R"(([0-9]{2})[-_:.]?([0-9]{2})(?:[-_.,]?([0-9]{3}|[0-9]{6}|[0-9]{9}))?(?:Z|[-+][0-9]{2}[:][0-9]{2})?)"),
       date_us, always},
      {"the seconds", Kind::time, std::regex(R"((|.*?[^0-9])([0-9]{1,9})(?:\.([0-9]+))?)"),
       [](const std::smatch& parts) { return number(parts[2]) * kSecondUs + fraction_us(parts[3]); },
       are_decimals},
      {"the hexadecimal numbers", Kind::hexadecimal, std::regex(R"((|.*?[^0-9A-Fa-f])([0-9A-Fa-f]{1,15}))"),
       [](const std::smatch& parts) { return number(parts[2], 16); }, are_hexadecimal},
      {"the numbers", Kind::number, std::regex(R"(((?=.*[0-9]).*?)([0-9]{0,9}))"),
       [](const std::smatch& parts) { return number(parts[2]); }, always}};
  return known;
}

std::string without_digits(std::string text) {
  std::erase_if(text, [](char c) { return c >= '0' && c <= '9'; });
  return text;
}

/// Groups pictures by their prefix.
std::map<std::string, Entries> by_prefix(const Naming& naming, const std::vector<fs::path>& images) {
  std::map<std::string, Entries> entries;
  std::smatch parts;
  for (const fs::path& image : images) {
    const std::string stem = image.stem().string();
    if (!std::regex_match(stem, parts, naming.form)) continue;
    if (const std::int64_t value = naming.value(parts); value >= 0)
      entries[without_digits(parts[1])].push_back({image, value, parts[parts.size() - 1]});
  }
  return entries;
}

/// Returns the largest series of pictures, and how their names are read.
std::pair<const Naming*, Entries> largest_series(const std::vector<fs::path>& images) {
  const auto largest = [&](const Naming& naming) {
    const auto entries = by_prefix(naming, images);
    const auto most =
        std::ranges::max_element(entries, {}, [](const auto& series) { return series.second.size(); });
    return most == entries.end() ? Entries() : most->second;
  };
  const Naming* plain = &namings().back();
  const Entries plain_entries = largest(*plain);
  for (const Naming& naming : namings()) {
    const std::size_t least =
        naming.kind == Naming::Kind::hexadecimal ? plain_entries.size() + 1 : images.size() / 2 + 1;
    Entries entries = largest(naming);
    if (entries.size() < std::max<std::size_t>(least, 2) || !naming.fits(entries)) continue;
    std::ranges::stable_sort(entries, {}, [&](const Entry& p) { return &naming == plain ? 0 : p.value; });
    return {&naming, entries};
  }
  return {plain, {}};
}

std::vector<std::int64_t> steps_of(const std::vector<std::int64_t>& values) {
  std::vector<std::int64_t> steps;
  for (std::size_t i = 1; i < values.size(); ++i) steps.push_back(values[i] - values[i - 1]);
  return steps;
}

bool increases(const std::vector<std::int64_t>& values) {
  return std::ranges::adjacent_find(values, std::greater_equal<>()) == values.end();
}

/// Returns frame numbers from 0. If most numbers in the names differ by the same step, and the others by a
/// multiple of it, the recorder left out frames, and the numbers have the same gaps. Otherwise they have
/// none.
std::vector<std::int64_t> frame_numbers(const std::vector<std::int64_t>& named) {
  std::vector<std::int64_t> numbers(named.size());
  std::iota(numbers.begin(), numbers.end(), 0);
  if (named.size() < 3 || !increases(named)) return numbers;
  const std::vector<std::int64_t> steps = steps_of(named);
  const std::int64_t step = *std::ranges::min_element(steps);
  const bool usual = 2 * std::ranges::count(steps, step) > std::ssize(steps);
  if (!usual || std::ranges::any_of(steps, [&](std::int64_t s) { return s % step != 0; })) return numbers;
  std::ranges::transform(named, numbers.begin(), [&](std::int64_t n) { return (n - named.front()) / step; });
  return numbers;
}

/// Returns a warning if a clock seems to have been set back during the recording, else "". Images of two
/// times are then interleaved, and two steps together make the usual one.
std::string warning_of(const std::vector<std::int64_t>& unix_us, std::int64_t usual_us,
                       const std::vector<fs::path>& images) {
  constexpr int kFewestMixed = 6;
  int mixed = 0;
  for (std::size_t i = 2; i < unix_us.size(); ++i) {
    mixed = 5 * std::abs(unix_us[i] - unix_us[i - 2] - usual_us) < usual_us ? mixed + 1 : 0;
    if (mixed == kFewestMixed)
      return images[i].string() +
             ": taken after half of the usual time, as several before it; if the clock "
             "was set back there, their order is wrong";
  }
  return "";
}

/// Throws Error if the names belong to several logs, or to one log in two formats: left_1.png and
/// right_1.png, 1.png and 1.jpg. Returns a warning about single images with other names, which are left out.
/// `most` are those of `images` that form one series.
std::string others_than(const Entries& most, const fs::path& folder, const std::vector<fs::path>& images) {
  std::set<std::string> stems;
  std::set<fs::path> of_most;
  for (const Entry& entry : most) of_most.insert(entry.image);
  std::map<std::string, std::vector<std::string>> series;
  std::vector<std::string> others;
  for (const fs::path& image : images) {
    const std::string stem = image.stem().string(), name = image.filename().string();
    if (!stems.insert(stem).second)
      throw Error(folder.string() + ": holds " + name + " in another format, too; keep one of them");
    if (of_most.contains(image)) continue;
    series[without_digits(stem)].push_back(name);
    others.push_back(name);
  }
  if (others.empty()) return "";
  // More series than this are another naming scheme, and not several sensors.
  constexpr std::size_t kMaxSensors = 4;
  const auto several = [](const auto& names) { return names.second.size() > 1; };
  const std::size_t count = series.size() + (most.empty() ? 0 : 1);
  if (count > 1 && count <= kMaxSensors && std::ranges::all_of(series, several))
    throw Error(
        fmt::format("{}: holds several series of pictures ({}, {}); give each a folder of its own",
                    folder.string(), series.begin()->second.front(),
                    most.empty() ? series.rbegin()->second.front() : most.front().image.filename().string()));
  if (most.empty()) return "";
  return fmt::format("{}: {} not named like {} and left out: {}", folder.string(),
                     others.size() == 1 ? "a picture is" : fmt::format("{} pictures are", others.size()),
                     most.front().image.filename().string(), others.front());
}

/// Orders the pictures of a folder by the numbers or times in the names of the largest series.
Series series_of(const fs::path& folder, std::vector<fs::path> images, double profile_rate_hz) {
  const auto& [naming, entries] = largest_series(images);
  Series series;
  series.warning = others_than(entries, folder, images);
  series.rate_hz = profile_rate_hz;
  if (entries.empty()) {
    series.images = std::move(images);
    series.order = "in the order of their names";
    series.numbers.resize(series.images.size());
    std::iota(series.numbers.begin(), series.numbers.end(), 0);
    return series;
  }
  std::vector<std::int64_t> values;
  for (const Entry& entry : entries) {
    series.images.push_back(entry.image);
    values.push_back(entry.value);
  }
  series.order = "in the order of " + naming->words + " in their names";
  series.numbers = frame_numbers(naming->is_time() ? std::vector<std::int64_t>(values.size()) : values);
  if (!naming->is_time()) return series;
  if (const auto twice = std::ranges::adjacent_find(values); twice != values.end()) {
    append_sentence(series.warning,
                    fmt::format("{}: its name gives no time of its own; times are counted at {:g} Hz",
                                series.images[static_cast<std::size_t>(twice - values.begin())].string(),
                                profile_rate_hz));
    return series;
  }
  series.times_us = std::move(values);
  series.is_unix = naming->kind == Naming::Kind::unix_time;
  const std::int64_t usual_us = quantile(steps_of(series.times_us), 0.5);
  series.rate_hz = 1e6 / static_cast<double>(usual_us);
  append_sentence(series.warning, warning_of(series.times_us, usual_us, series.images));
  return series;
}

class ImageFolderSource final : public RawFrameSource {
 public:
  ImageFolderSource(fs::path folder, Series series)
      : folder_(std::move(folder)), series_(std::move(series)) {}

  std::optional<RawFrame> next() override {
    if (stopped_ || index_ == series_.images.size()) return std::nullopt;
    RawFrame frame = read_image_file(series_.images[index_]);
    frame.index = static_cast<std::int64_t>(index_);
    frame.sequence = series_.numbers[index_];
    frame.time_s = series_.time_s(index_);
    if (series_.is_unix) frame.unix_us = series_.times_us[index_];
    ++index_;
    frame.arrived = std::chrono::steady_clock::now();
    return frame;
  }

  void stop() override { stopped_ = true; }
  double rate_hz() const override { return series_.rate_hz; }
  std::optional<std::int64_t> frame_count() const override { return std::ssize(series_.images); }
  std::string description() const override {
    return fmt::format("folder {} of {} images {}, {:g} Hz{}{}", folder_.string(), series_.images.size(),
                       series_.order, series_.rate_hz, series_.times_us.empty() ? "" : " by these times",
                       series_.missing());
  }
  std::string warning() const override { return series_.warning; }
  std::int64_t lost_frames() const override {
    return index_ == 0 ? 0 : series_.numbers[index_ - 1] + 1 - static_cast<std::int64_t>(index_);
  }

 private:
  fs::path folder_;
  Series series_;
  std::size_t index_ = 0;
  std::atomic<bool> stopped_ = false;
};

}  // namespace

bool has_image_ending(const fs::path& path) {
  static constexpr std::array endings{".png", ".jpg", ".jpeg", ".bmp"};
  const std::string ending = lower_case(path.extension().string());
  return std::find(endings.begin(), endings.end(), ending) != endings.end();
}

std::vector<fs::path> list_images(const fs::path& folder) {
  std::vector<fs::path> images;
  std::error_code code;
  for (fs::directory_iterator entry(folder, code), end; !code && entry != end; entry.increment(code)) {
    const fs::path& path = entry->path();
    std::error_code not_a_file;
    const bool hidden = path.filename().string().starts_with(".");
    if (hidden || path.stem() == "background" || !has_image_ending(path)) continue;
    if (entry->is_symlink(not_a_file) && !entry->exists(not_a_file))
      throw Error(path.string() +
                  ": is a link to a file that is not there; fetch it (git annex get, dvc pull)");
    if (entry->is_regular_file(not_a_file)) images.push_back(path);
  }
  if (code) throw Error(folder.string() + ": cannot be listed: " + code.message());
  std::sort(images.begin(), images.end(), [](const fs::path& a, const fs::path& b) {
    return natural_less(a.filename().string(), b.filename().string());
  });
  return images;
}

std::unique_ptr<RawFrameSource> open_image_folder(const fs::path& folder, std::vector<fs::path> images,
                                                  const SensorProfile& profile) {
  return std::make_unique<ImageFolderSource>(folder,
                                             series_of(folder, std::move(images), profile.frame_rate_hz));
}

}  // namespace gelslam::detail
