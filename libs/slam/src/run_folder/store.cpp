#include "gelslam/slam/store.hpp"

#include <SQLiteCpp/Backup.h>
#include <sqlite3.h>

#include <random>
#include <utility>

#include "gelslam/core/crc32.hpp"
#include "run_folder/database.hpp"

namespace gelslam {

using namespace slam::detail;

namespace {

namespace fs = std::filesystem;
using Access = Database::Access;

constexpr std::size_t kFramesAtOnce = 25;  // About one second of frames, which a kill may lose.

template <std::size_t count>
Blob blob_of(const Numbers<count>& numbers) {
  Blob blob{{reinterpret_cast<const char*>(numbers.data()), sizeof numbers}};
  const std::uint32_t sum = crc32_of(blob.bytes);
  blob.bytes.append(reinterpret_cast<const char*>(&sum), sizeof sum);
  return blob;
}

Numbers<12> numbers(const Pose& pose) {
  Numbers<12> values;
  Eigen::Map<Eigen::Matrix<double, 3, 4, Eigen::RowMajor>>(values.data()) = pose.matrix().topRows<3>();
  return values;
}

/// Returns the upper triangle, row by row.
Numbers<21> numbers(const Matrix6d& symmetric) {
  Numbers<21> values;
  std::size_t k = 0;
  for (int r = 0; r < 6; ++r)
    for (int c = r; c < 6; ++c) values[k++] = symmetric(r, c);
  return values;
}

Numbers<3> numbers(const Eigen::Vector3d& mm) { return {mm.x(), mm.y(), mm.z()}; }

void insert(SQLite::Database& database, const ScanPart& part) {
  run(database, "INSERT INTO parts VALUES(NULL,?,?,?,?)", part.first_frame, part.sensor, part.model_crc32,
      part.log);
}

std::optional<std::int64_t> unless_negative(int value) {
  return value < 0 ? std::nullopt : std::optional<std::int64_t>(value);
}

/// Returns the value of the column "observable": one bit per motion.
int bits_of(const FrameRecord& frame) {
  int bits = 0;
  for (int i = 0; i < 6; ++i) bits |= int{frame.observable[static_cast<std::size_t>(i)]} << i;
  return bits;
}

void insert(SQLite::Database& database, const std::vector<FrameRecord>& frames) {
  SQLite::Statement insert(database, "INSERT INTO frames VALUES(?,?,?,?,?,?,?,?,?,?)");
  for (const FrameRecord& frame : frames) {
    const Numbers<12> pose = numbers(frame.keyframe_T_frame);
    const Numbers<21> covariance = numbers(frame.covariance);
    const Numbers<3> center = numbers(frame.shared_center_mm);
    const auto keyframe = unless_negative(frame.keyframe);
    run(insert, frame.frame, frame.time_s, std::string(name(frame.status)), unless_negative(frame.trial),
        keyframe, keyframe ? std::optional(blob_of(pose)) : std::nullopt,
        keyframe ? std::optional(blob_of(covariance)) : std::nullopt,
        keyframe ? std::optional(blob_of(center)) : std::nullopt, bits_of(frame),
        frame.unix_us == 0 ? std::nullopt : std::optional(frame.unix_us));
  }
}

void insert(SQLite::Database& database, const Keyframe& keyframe) {
  run(database, "INSERT INTO keyframes VALUES(?,?,?,?)", keyframe.id, keyframe.frame, keyframe.trial,
      Blob{keyframe.surface.packed().bytes()});
}

void insert(SQLite::Database& database, const std::vector<PoseGraphEdge>& edges) {
  SQLite::Statement insert(database, "INSERT INTO edges VALUES(NULL,?,?,?,?,?,?,?)");
  for (const PoseGraphEdge& edge : edges) {
    const Numbers<12> from_T_to = numbers(edge.from_T_to);
    const Numbers<21> information = numbers(edge.information);
    const Numbers<3> center = numbers(edge.shared_center_mm);
    run(insert, edge.from, edge.to, word(edge.kind), blob_of(from_T_to), blob_of(information),
        blob_of(center), int{edge.tentative});
  }
}

void insert_searched(SQLite::Database& database, int keyframe) {
  run(database, "INSERT INTO searched VALUES(?)", keyframe);
}

void insert(SQLite::Database& database, const SlamMap& map) {
  for (const char* table : {"DELETE FROM map", "DELETE FROM poses", "DELETE FROM map_edges"})
    database.exec(table);
  run(database, "INSERT INTO map VALUES(?,?)", map.gradient_scale().mean(), map.next_frame() - 1);
  SQLite::Statement pose(database, "INSERT INTO poses VALUES(?,?,?,?)");
  const MapSnapshot snapshot = snapshot_of(map);
  for (const MapSnapshot::Node& node : snapshot.nodes) {
    const Numbers<12> values = numbers(node.component_T_keyframe);
    run(pose, node.keyframe, node.component, int{node.placed}, blob_of(values));
  }
  SQLite::Statement edge(database, "INSERT INTO map_edges VALUES(NULL,?,?,?,?)");
  for (const MapSnapshot::Edge& solved : snapshot.edges)
    run(edge, solved.from, solved.to, word(solved.kind), int{solved.outlier});
}

/// Returns a number that identifies the scan. The same log always gives the same file.
std::uint32_t number_of(const std::string& log) {
  return log.empty() ? std::random_device()() : crc32_of(log);
}

}  // namespace

Store::Store(const fs::path& run) : database_(std::make_unique<Database>(session_file(run), Access::write)) {}
Store::~Store() = default;

void Store::write(Work work) {
  waiting_.push_back(std::move(work));
  if (refused_ == 0 || waiting_.size() >= refused_ + kFramesAtOnce) flush();
}

void Store::flush() {
  refused_ = waiting_.size();
  database_->transact([&](SQLite::Database& database) {
    for (const Work& work : waiting_) work(database);
  });
  waiting_.clear();
  refused_ = 0;
}

void Store::add(const ScanPart& part) {
  write([part](SQLite::Database& database) { insert(database, part); });
}

void Store::add(const FrameRecord& frame) {
  waiting_.push_back([frame](SQLite::Database& database) { insert(database, std::vector{frame}); });
  if (waiting_.size() >= refused_ + kFramesAtOnce) flush();
}

void Store::add(const NewKeyframe& added) {
  write([added](SQLite::Database& database) {
    insert(database, *added.keyframe);
    if (added.edge) insert(database, std::vector{*added.edge});
  });
}

void Store::add_loops(int keyframe, const std::vector<PoseGraphEdge>& loops) {
  write([keyframe, loops](SQLite::Database& database) {
    insert(database, loops);
    insert_searched(database, keyframe);
  });
}

void Store::set_map(const SlamMap& map) {
  waiting_.push_back([&map](SQLite::Database& database) { insert(database, map); });
  flush();
}

void begin_store(const fs::path& run, const ScanPart& part) {
  Database database(run / "session.db", Access::create, number_of(part.log));
  database.transact([&](SQLite::Database& connection) { insert(connection, part); });
}

void write_store(const fs::path& run, const SlamMap& map) {
  Database file(run / "session.db", Access::create, map.parts.empty() ? 0 : number_of(map.parts.front().log));
  file.transact([&](SQLite::Database& database) {
    for (const ScanPart& part : map.parts) insert(database, part);
    insert(database, map.frames);
    for (const auto& keyframe : map.keyframes)
      if (keyframe) insert(database, *keyframe);
    insert(database, map.edges);
    for (std::size_t id = 0; id < map.searched.size(); ++id)
      if (map.searched[id]) insert_searched(database, static_cast<int>(id));
    insert(database, map);
  });
}

void copy_store(const fs::path& run, const fs::path& to) {
  Database from(session_file(run), Access::read), target(to / "session.db", Access::create);
  from.with([&](SQLite::Database& database) {
    target.with([&](SQLite::Database& copy) {
      if (SQLite::Backup(copy, database).executeStep() != SQLITE_DONE)
        throw SQLite::Exception("locked", SQLITE_BUSY);
    });
  });
}

}  // namespace gelslam
