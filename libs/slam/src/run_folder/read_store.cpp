#include <fmt/format.h>

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

// What a session may name. Beyond it, files are forged or damaged: programs that number on, add poses or make
// lists by these numbers rely on it.
constexpr int kMaxKeyframeId = 1'000'000;
constexpr int kMaxTrial = 1'000'000;
constexpr std::int64_t kMaxFrames = 24 * 3600 * 30;  // a day's: 0.5 GB
constexpr std::int64_t kMaxFrame = 1'000'000'000'000;
constexpr double kMaxDistanceMm = 1e6;    // as in trajectories
constexpr double kMaxInformation = 1e12;  // sigmas of a millionth of a radian and of a millimeter

template <std::size_t count>
Numbers<count> numbers_in(const Statement& row, int column, double most) {
  const std::string_view bytes = row.blob(column);
  Numbers<count> values;
  std::uint32_t sum = 0;
  if (bytes.size() != sizeof values + sizeof sum) row.fail("the numbers of a row are incomplete");
  std::memcpy(values.data(), bytes.data(), sizeof values);
  std::memcpy(&sum, bytes.data() + sizeof values, sizeof sum);
  if (sum != crc32_of(bytes.substr(0, sizeof values)))
    row.fail("damaged: the checksum of a row does not match");
  for (const double value : values)
    if (!(std::abs(value) <= most)) row.fail("holds an impossible number");
  return values;
}

Pose pose_in(const Statement& row, int column) {
  const Numbers<12> values = numbers_in<12>(row, column, kMaxDistanceMm);
  Pose pose = Pose::Identity();
  pose.matrix().topRows<3>() = Eigen::Map<const Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(values.data());
  const bool rotation = pose.linear().isUnitary(1e-6) && std::abs(pose.linear().determinant() - 1.0) < 1e-6;
  if (!rotation) row.fail("a pose is no rigid motion");
  return pose;
}

Matrix6d matrix_in(const Statement& row, int column) {
  const Numbers<21> values = numbers_in<21>(row, column, kMaxInformation);
  Matrix6d matrix;
  std::size_t k = 0;
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) matrix(r, c) = matrix(c, r) = values[k++];
  return matrix;
}

EdgeKind kind_in(const Statement& row, int column) {
  const std::string text = row.text(column);
  for (const EdgeKind kind : {EdgeKind::loop, EdgeKind::odometry})
    if (word(kind) == text) return kind;
  row.fail("unknown kind of an edge");
}

TrackStatus status_in(const Statement& row, int column) {
  const std::string text = row.text(column);
  for (const TrackStatus status :
       {TrackStatus::background, TrackStatus::no_contact, TrackStatus::tracked, TrackStatus::lost})
    if (name(status) == text) return status;
  if (text == "undone") return TrackStatus::lost;  // taken back, by an older program
  row.fail("unknown status of a frame");
}

bool flag_in(const Statement& row, int column) { return row.integer(column, 0, 1) != 0; }

int id_in(const Statement& row, int column) { return row.integer(column, 0, kMaxKeyframeId); }

/// The rows of a table by its first column, a number. That it ascends bounds what a forged file can give.
class Rows : public Statement {
 public:
  Rows(Database& database, const char* sql) : Statement(database, sql) {}
  bool next() {
    if (!Statement::next()) return false;
    const std::int64_t key = integer(0, 0, std::int64_t{INT64_MAX});
    if (key <= last_) fail("its rows are not in order");
    last_ = key;
    return true;
  }

 private:
  std::int64_t last_ = -1;
};

PackedSurface surface_in(const Statement& row, int column, int keyframe) {
  try {
    return PackedSurface::from_bytes(std::string(row.blob(column)));
  } catch (const Error& error) {
    row.fail(fmt::format("keyframe {}: {}", keyframe, error.what()));
  }
}

void read_parts(Database& database, ScanRecord& record) {
  Rows rows(database, "SELECT id, first_frame, sensor, model_crc32, log FROM parts ORDER BY 1");
  while (rows.next()) {
    const std::int64_t after = record.parts.empty() ? 0 : record.parts.back().first_frame;
    record.parts.push_back({rows.integer(1, after, kMaxFrame), rows.text(2),
                            rows.integer(3, 0, std::numeric_limits<std::uint32_t>::max()), rows.text(4)});
  }
  if (record.parts.empty()) database.fail("holds the map of a mesh, and no scan");
}

/// An id that was given is never free again, whatever became of the keyframe.
void read_keyframes(Database& database, const NormalFlowOptions& registration, ScanRecord& record) {
  Rows rows(database, "SELECT id, frame, trial, surface FROM keyframes ORDER BY 1");
  while (rows.next()) {
    auto keyframe = std::make_shared<Keyframe>();
    keyframe->id = id_in(rows, 0);
    keyframe->frame = rows.integer(1, 0, kMaxFrame);
    keyframe->trial = rows.integer(2, 0, kMaxTrial);
    record.keyframes.resize(static_cast<std::size_t>(keyframe->id) + 1);
    if (rows.is_null(3)) continue;  // taken back, by an older program
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

/// Keyframe by keyframe. Those of keyframes that were taken back are left out.
void read_edges(Database& database, ScanRecord& record) {
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
    edge.shared_center_mm = Eigen::Vector3d(numbers_in<3>(rows, 6, kMaxDistanceMm).data());
    edge.tentative = flag_in(rows, 7);
    if (record.has_keyframe(edge.from) && record.has_keyframe(edge.to)) record.edges.push_back(edge);
  }
  std::stable_sort(record.edges.begin(), record.edges.end(),
                   [](const PoseGraphEdge& a, const PoseGraphEdge& b) { return a.to < b.to; });
}

void read_frames(Database& database, ScanRecord& record) {
  Statement count(database, "SELECT count(*) FROM frames");
  const std::int64_t frames = count.next() ? count.integer(0, 0, std::int64_t{INT64_MAX}) : 0;
  if (frames > kMaxFrames) count.fail("holds more frames than a day of scanning makes");
  record.frames.reserve(static_cast<std::size_t>(frames));
  Rows rows(
      database,
      "SELECT frame, time_s, status, trial, keyframe, keyframe_T_frame, observable, unix_us FROM frames "
      "ORDER BY 1");
  while (rows.next()) {
    FrameRecord frame;
    frame.frame = rows.integer(0, 0, kMaxFrame);
    frame.time_s = rows.number(1, kMaxTimeS);
    frame.status = status_in(rows, 2);
    if (!rows.is_null(3)) frame.trial = rows.integer(3, 0, kMaxTrial);
    if (!rows.is_null(4)) {
      frame.keyframe = id_in(rows, 4);
      frame.keyframe_T_frame = pose_in(rows, 5);
      if (frame.trial < 0) rows.fail("a frame with a keyframe has no trial");
    }
    const int observable = rows.integer(6, 0, 127);
    for (std::size_t i = 0; i < 6; ++i) frame.observable[i] = (observable >> i & 1) != 0;
    frame.apart = observable >> 6 != 0;
    if (!rows.is_null(7)) frame.unix_us = rows.integer(7, 1, kMaxUnixUs);
    if (!record.has_keyframe(frame.keyframe)) frame.keyframe = -1;  // a kill came before it
    record.frames.push_back(frame);
  }
  for (const auto& keyframe : record.keyframes)
    if (keyframe &&
        !std::binary_search(record.frames.begin(), record.frames.end(), FrameRecord{.frame = keyframe->frame},
                            [](const FrameRecord& a, const FrameRecord& b) { return a.frame < b.frame; }))
      database.fail(fmt::format("keyframe {} is of a frame that is not there", keyframe->id));
}

/// Those in the map; `ids` of all that have one.
std::map<int, Pose> read_poses(Database& database, std::vector<int>& ids) {
  std::map<int, Pose> map_T_keyframe;
  Rows rows(database, "SELECT keyframe, in_map, pose FROM poses ORDER BY 1");
  while (rows.next()) {
    ids.push_back(id_in(rows, 0));
    const Pose pose = pose_in(rows, 2);
    if (flag_in(rows, 1)) map_T_keyframe.emplace(ids.back(), pose);
  }
  return map_T_keyframe;
}

/// Returns the ids of all keyframes that were not taken back.
std::vector<int> read_patches(Database& database, const std::map<int, Pose>& map_T_keyframe,
                              Session& session) {
  std::vector<int> ids;
  Rows rows(database, "SELECT id, surface FROM keyframes ORDER BY 1");
  while (rows.next()) {
    if (rows.is_null(1)) continue;
    ids.push_back(id_in(rows, 0));
    if (const auto place = map_T_keyframe.find(ids.back()); place != map_T_keyframe.end())
      session.patches.push_back(
          {place->first, place->second, StoredSurface(surface_in(rows, 1, place->first))});
  }
  return ids;
}

void read_map_edges(Database& database, Session& session) {
  Rows rows(database, "SELECT id, from_keyframe, to_keyframe, kind, outlier FROM map_edges ORDER BY 1");
  while (rows.next())
    session.edges.push_back({id_in(rows, 1), id_in(rows, 2), kind_in(rows, 3), flag_in(rows, 4)});
}

std::int64_t last_frame(Database& database) {
  Statement row(database, "SELECT max(frame) FROM frames");
  return row.next() && !row.is_null(0) ? row.integer(0, 0, kMaxFrame) : -1;
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
  Database database(session_file(run), Access::read);
  ScanRecord record;
  read_parts(database, record);
  read_keyframes(database, registration, record);
  read_edges(database, record);
  read_frames(database, record);
  return record;
}

std::optional<Session> find_session(const fs::path& run) {
  Database database(session_file(run), Access::read);
  Statement map(database, "SELECT gradient_scale, last_frame FROM map");
  if (!map.next()) return std::nullopt;
  Session session;
  session.gradient_scale = map.number(0, 10);
  if (!(session.gradient_scale > 0.1)) map.fail("impossible gradient scale");
  std::vector<int> placed;
  const std::map<int, Pose> map_T_keyframe = read_poses(database, placed);
  if (read_patches(database, map_T_keyframe, session) != placed ||
      last_frame(database) > map.integer(1, -1, kMaxFrame))
    session.warning =
        run.string() + ": the scan went on after its map was saved; fuse the run for the map of all of it";
  read_map_edges(database, session);
  ScanRecord measured;  // what the map was made of must be whole, too
  read_edges(database, measured);
  read_frames(database, measured);
  return session;
}

Session load_session(const fs::path& run) {
  if (has_incomplete_save(run)) throw Error(run.string() + ": " + kIncompleteSave);
  if (std::optional<Session> session = find_session(run)) return *std::move(session);
  refuse_unfinished(run);
}

}  // namespace gelslam
