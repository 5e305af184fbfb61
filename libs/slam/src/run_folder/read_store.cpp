#include <fmt/format.h>
#include <sqlite3.h>

#include <algorithm>
#include <cstring>
#include <limits>
#include <map>
#include <utility>

#include "gelslam/core/crc32.hpp"
#include "gelslam/core/error.hpp"
#include "gelslam/core/run_folder.hpp"
#include "gelslam/slam/store.hpp"
#include "run_folder/database.hpp"

namespace gelslam {

using namespace slam::detail;

namespace {

namespace fs = std::filesystem;
using Access = Database::Access;

// Bounds of the values in a session. Larger values mean that the file is damaged or forged. Code that
// continues numbers, adds poses or allocates by these numbers relies on the bounds.
// Each keyframe and each trial has at least one frame.
constexpr int kMaxKeyframeId = kMaxScanFrames - 1, kMaxTrial = kMaxKeyframeId;
constexpr std::int64_t kMaxFrame = 1'000'000'000'000;
constexpr double kMaxDistanceMm = 1e6;    // The same limit as in trajectories.
constexpr double kMaxInformation = 1e12;  // The square of the inverse of 1e-6 rad or mm.

/// Rows of a query in ascending order of their first column, an integer. The required order limits how many
/// rows a forged file can return.
class Rows {
 public:
  Rows(SQLite::Database& database, const char* sql) : statement_(database, sql) {}
  bool next() {
    if (!statement_.executeStep()) return false;
    const std::int64_t key = integer(0, 0, std::int64_t{INT64_MAX});
    if (key <= std::exchange(last_, key)) refuse("its rows are not in order");
    return true;
  }

  // Return a column of the row. A value of another type or outside the bounds is refused.
  bool is_null(int column) const { return statement_.isColumnNull(column); }
  template <typename Integer>
  Integer integer(int column, std::int64_t least, Integer most) const {
    const std::int64_t value = of_type(column, SQLITE_INTEGER);
    if (value < least || value > std::int64_t{most}) refuse("holds an impossible number");
    return static_cast<Integer>(value);
  }
  double number(int column, double most) const { return bounded(of_type(column, SQLITE_FLOAT), most); }
  std::string text(int column) const { return of_type(column, SQLITE_TEXT); }
  template <std::size_t count>
  Numbers<count> numbers(int column, double most) const {
    const std::string bytes = blob(column);
    Numbers<count> values;
    std::uint32_t sum = 0;
    if (bytes.size() != sizeof values + sizeof sum) refuse("the numbers of a row are incomplete");
    std::memcpy(values.data(), bytes.data(), sizeof values);
    std::memcpy(&sum, bytes.data() + sizeof values, sizeof sum);
    if (sum != crc32_of(std::string_view(bytes).substr(0, sizeof values)))
      refuse("damaged: the checksum of a row does not match");
    for (const double value : values) bounded(value, most);
    return values;
  }
  std::string blob(int column) const { return of_type(column, SQLITE_BLOB); }

 private:
  static double bounded(double value, double most) {
    if (!(std::abs(value) <= most)) refuse("holds an impossible number");
    return value;
  }
  SQLite::Column of_type(int column, int type) const {
    const SQLite::Column value = statement_.getColumn(column);
    if (value.getType() != type) refuse(kNotASession);
    return value;
  }

  SQLite::Statement statement_;
  std::int64_t last_ = -1;
};

Pose pose_in(const Rows& row, int column) {
  const Numbers<12> values = row.numbers<12>(column, kMaxDistanceMm);
  Pose pose = Pose::Identity();
  pose.matrix().topRows<3>() = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(values.data());
  const bool rotation = pose.linear().isUnitary(1e-6) && std::abs(pose.linear().determinant() - 1.0) < 1e-6;
  if (!rotation) refuse("a pose is no rigid motion");
  return pose;
}

Matrix6d matrix_in(const Rows& row, int column) {
  const Numbers<21> values = row.numbers<21>(column, kMaxInformation);
  Matrix6d matrix;
  std::size_t k = 0;
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) matrix(r, c) = matrix(c, r) = values[k++];
  return matrix;
}

EdgeKind kind_in(const Rows& row, int column) {
  const std::string text = row.text(column);
  for (const EdgeKind kind : {EdgeKind::loop, EdgeKind::odometry})
    if (word(kind) == text) return kind;
  refuse("unknown kind of an edge");
}

TrackStatus status_in(const Rows& row, int column) {
  const std::string text = row.text(column);
  for (const TrackStatus status :
       {TrackStatus::background, TrackStatus::no_contact, TrackStatus::tracked, TrackStatus::lost})
    if (name(status) == text) return status;
  // Written by older versions for frames that they withdrew.
  if (text == "undone") return TrackStatus::lost;
  refuse("unknown status of a frame");
}

bool flag_in(const Rows& row, int column) { return row.integer(column, 0, 1) != 0; }

int id_in(const Rows& row, int column) { return row.integer(column, 0, kMaxKeyframeId); }

PackedSurface surface_in(const Rows& row, int column, int keyframe) {
  try {
    return PackedSurface::from_bytes(row.blob(column));
  } catch (const Error& error) {
    refuse(fmt::format("keyframe {}: {}", keyframe, error.what()));
  }
}

void read_parts(SQLite::Database& database, ScanRecord& record) {
  Rows rows(database, "SELECT id, first_frame, sensor, model_crc32, log FROM parts ORDER BY 1");
  while (rows.next()) {
    const std::int64_t after = record.parts.empty() ? 0 : record.parts.back().first_frame;
    record.parts.push_back({rows.integer(1, after, kMaxFrame), rows.text(2),
                            rows.integer(3, 0, std::numeric_limits<std::uint32_t>::max()), rows.text(4)});
  }
  if (record.parts.empty()) refuse("holds the map of a mesh, and no scan");
}

/// The ids of withdrawn keyframes are not reused, so the vector can contain null entries.
void read_keyframes(SQLite::Database& database, const NormalFlowOptions& registration, ScanRecord& record) {
  Rows rows(database,
            "SELECT id, frame, trial, surface, id NOT IN (SELECT keyframe FROM searched) AND id NOT IN "
            "(SELECT keyframe FROM frames WHERE keyframe IS NOT NULL) FROM keyframes ORDER BY 1");
  while (rows.next()) {
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = id_in(rows, 0);
    keyframe->frame = rows.integer(1, 0, kMaxFrame);
    keyframe->trial = rows.integer(2, 0, kMaxTrial);
    keyframe->is_patch = flag_in(rows, 4);
    record.keyframes.resize(static_cast<std::size_t>(keyframe->id) + 1);
    if (rows.is_null(3)) continue;  // Withdrawn by an older version of the program.
    keyframe->surface = StoredSurface(surface_in(rows, 3, keyframe->id));
    keyframe->reference = StoredReference(keyframe->surface, registration);
    record.keyframes.back() = std::move(keyframe);
  }
  record.searched.resize(record.keyframes.size());
  Rows searched(database, "SELECT keyframe FROM searched ORDER BY 1");
  while (searched.next())
    if (const int id = id_in(searched, 0); record.has_keyframe(id))
      record.searched[static_cast<std::size_t>(id)] = true;
}

/// Reads the edges, sorted by their newer keyframe, without those of withdrawn keyframes.
void read_edges(SQLite::Database& database, ScanRecord& record) {
  Rows rows(
      database,
      "SELECT id, from_keyframe, to_keyframe, kind, from_T_to, information, shared_center_mm, tentative "
      "FROM edges ORDER BY 1");
  while (rows.next()) {
    PoseGraphEdge edge;
    edge.to = rows.integer(2, 1, kMaxKeyframeId);
    edge.from = rows.integer(1, 0, edge.to - 1);
    edge.kind = kind_in(rows, 3);
    edge.from_T_to = pose_in(rows, 4);
    edge.information = matrix_in(rows, 5);
    edge.shared_center_mm = Eigen::Vector3d(rows.numbers<3>(6, kMaxDistanceMm).data());
    edge.tentative = flag_in(rows, 7);
    if (record.has_keyframe(edge.from) && record.has_keyframe(edge.to)) record.edges.push_back(edge);
  }
  std::stable_sort(record.edges.begin(), record.edges.end(),
                   [](const PoseGraphEdge& a, const PoseGraphEdge& b) { return a.to < b.to; });
}

void read_frames(SQLite::Database& database, ScanRecord& record) {
  const std::int64_t frames = database.execAndGet("SELECT count(*) FROM frames");
  if (frames > kMaxScanFrames) refuse("holds more frames than a day of scanning makes");
  record.frames.reserve(static_cast<std::size_t>(frames));
  Rows rows(database,
            "SELECT frame, time_s, status, trial, keyframe, keyframe_T_frame, covariance, shared_center_mm, "
            "observable, unix_us FROM frames ORDER BY 1");
  while (rows.next()) {
    FrameRecord frame;
    frame.frame = rows.integer(0, 0, kMaxFrame);
    frame.time_s = rows.number(1, kMaxTimeS);
    frame.status = status_in(rows, 2);
    if (!rows.is_null(3)) frame.trial = rows.integer(3, 0, kMaxTrial);
    if (!rows.is_null(4)) {
      frame.keyframe = id_in(rows, 4);
      frame.keyframe_T_frame = pose_in(rows, 5);
      frame.covariance = matrix_in(rows, 6);
      frame.shared_center_mm = Eigen::Vector3d(rows.numbers<3>(7, kMaxDistanceMm).data());
      if (frame.trial < 0) refuse("a frame with a keyframe has no trial");
    }
    const int observable = rows.integer(8, 0, 127);  // The seventh bit was used by older versions.
    for (std::size_t i = 0; i < 6; ++i) frame.observable[i] = (observable >> i & 1) != 0;
    if (!rows.is_null(9)) frame.unix_us = rows.integer(9, 1, kMaxUnixUs);
    // The program was killed before it wrote the keyframe.
    if (!record.has_keyframe(frame.keyframe)) frame.keyframe = -1;
    record.frames.push_back(frame);
  }
  for (const auto& keyframe : record.keyframes)
    if (keyframe &&
        !std::binary_search(record.frames.begin(), record.frames.end(), FrameRecord{.frame = keyframe->frame},
                            [](const FrameRecord& a, const FrameRecord& b) { return a.frame < b.frame; }))
      refuse(fmt::format("keyframe {} is of a frame that is not there", keyframe->id));
}

/// Returns the poses of keyframes in the map. `ids` receives all keyframes that have a pose.
std::map<int, Pose> read_poses(SQLite::Database& database, std::vector<int>& ids) {
  std::map<int, Pose> map_T_keyframe;
  Rows rows(database, "SELECT keyframe, in_map, pose FROM poses ORDER BY 1");
  while (rows.next()) {
    ids.push_back(id_in(rows, 0));
    const Pose pose = pose_in(rows, 2);
    if (flag_in(rows, 1)) map_T_keyframe.emplace(ids.back(), pose);
  }
  return map_T_keyframe;
}

/// Reads the surfaces of keyframes in the map into `session`. Returns the ids of all keyframes that were not
/// withdrawn.
std::vector<int> read_patches(SQLite::Database& database, const std::map<int, Pose>& map_T_keyframe,
                              MapSnapshot& session) {
  std::vector<int> ids;
  Rows rows(database, "SELECT id, surface FROM keyframes ORDER BY 1");
  while (rows.next()) {
    if (rows.is_null(1)) continue;
    ids.push_back(id_in(rows, 0));
    if (const auto place = map_T_keyframe.find(ids.back()); place != map_T_keyframe.end())
      session.nodes.push_back({.keyframe = place->first,
                               .component_T_keyframe = place->second,
                               .surface = StoredSurface(surface_in(rows, 1, place->first))});
  }
  return ids;
}

void read_map_edges(SQLite::Database& database, MapSnapshot& session) {
  Rows rows(database, "SELECT id, from_keyframe, to_keyframe, kind, outlier FROM map_edges ORDER BY 1");
  while (rows.next())
    session.edges.push_back({id_in(rows, 1), id_in(rows, 2), kind_in(rows, 3), flag_in(rows, 4)});
}

}  // namespace

fs::path slam::detail::session_file(const fs::path& run) {
  check_run_files(run);
  const fs::path file = run / "session.db";
  std::error_code code;
  if (fs::exists(file, code)) return file;
  if (fs::exists(run / "session", code))
    throw Error(run.string() +
                ": its session is of an older version, which is not read any more; reconstruct "
                "its log again, into another folder");
  throw Error(run.string() + ": holds no session.db");
}

bool has_session(const fs::path& folder) {
  std::error_code code;
  return fs::exists(folder / "session.db", code) || fs::exists(folder / "session", code);
}

ScanRecord read_scan(const fs::path& run, const NormalFlowOptions& registration) {
  ScanRecord record;
  Database(session_file(run), Access::read).with([&](SQLite::Database& database) {
    read_parts(database, record);
    read_keyframes(database, registration, record);
    read_edges(database, record);
    read_frames(database, record);
  });
  return record;
}

std::optional<MapSnapshot> find_saved_map(const fs::path& run) {
  return Database(session_file(run), Access::read)
      .with([&](SQLite::Database& database) -> std::optional<MapSnapshot> {
        Rows map(database, "SELECT rowid, gradient_scale, last_frame FROM map");
        if (!map.next()) return std::nullopt;
        MapSnapshot session;
        session.gradient_scale.x = session.gradient_scale.y = map.number(1, 10);
        if (!(session.gradient_scale.x > 0.1)) refuse("impossible gradient scale");
        std::vector<int> placed;
        const std::map<int, Pose> map_T_keyframe = read_poses(database, placed);
        const std::int64_t last_frame = database.execAndGet("SELECT coalesce(max(frame), -1) FROM frames");
        if (read_patches(database, map_T_keyframe, session) != placed ||
            last_frame > map.integer(2, -1, kMaxFrame))
          session.warning =
              run.string() +
              ": the scan went on after its map was saved; fuse the run for the map of all of it";
        read_map_edges(database, session);
        ScanRecord measured;  // The measurements of the map must be readable, too.
        read_edges(database, measured);
        read_frames(database, measured);
        return session;
      });
}

MapSnapshot load_saved_map(const fs::path& run) {
  std::optional<MapSnapshot> session = is_unfinished(run) ? std::nullopt : find_saved_map(run);
  if (!session) refuse_unfinished(run);
  return *std::move(session);
}

}  // namespace gelslam
