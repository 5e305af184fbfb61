#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "../support/database.hpp"
#include "../support/temporary_folder.hpp"
#include "gelslam/slam/mapper.hpp"
#include "gelslam/slam/slam_options.hpp"
#include "gelslam/slam/store.hpp"
#include "small_map.hpp"

namespace gelslam::test {
namespace {

class DamagedStore : public testing::Test {
 protected:
  DamagedStore() { write_store(folder.path(), small_map()); }
  std::string both() {
    const std::string session = refusal([&] { load_saved_map(folder.path()); }),
                      scan = refusal([&] { read_scan(folder.path(), {}); });
    EXPECT_EQ(session, scan);
    EXPECT_THAT(refusal([&] { Store store(folder.path()); }), HasSubstr(session));
    return session;
  }

  TemporaryFolder folder;
  const fs::path file = folder / "session.db";
};

TEST_F(DamagedStore, IsNamedInOneLine) {
  for (const char* text : {"", "a text", "SQLite format 3"}) {
    write_bytes(file, text);
    EXPECT_THAT(both(), HasSubstr("session.db: damaged, or not a session of gelslam"));
  }
  fs::remove(file);
  EXPECT_THAT(both(), HasSubstr(": holds no session.db"));
  fs::create_directory(folder / "session");
  EXPECT_THAT(both(),
              HasSubstr(": its session is of an older version, which is not read any more; reconstruct"));
  fs::create_symlink("/etc/hostname", file);
  EXPECT_THAT(both(), HasSubstr("session.db: is a link"));
  fs::remove(file);
  write_store(folder.path(), small_map());
  write_bytes(folder / "session.db-journal", "/etc/hostname");
  EXPECT_THAT(both(), HasSubstr("session.db-journal: no run holds that"));
}

TEST_F(DamagedStore, OfAnotherVersionOrWithOtherTablesIsRefused) {
  const std::string good = read_bytes(file);
  for (const auto& [change, why] : std::vector<std::pair<std::string, std::string>>{
           {"PRAGMA user_version=7", "written by a newer version of the program (session version 7"},
           {"PRAGMA user_version=5", "written by an older version of the program (session version 5"},
           {"PRAGMA application_id=5", "not a session"},
           {"DROP TABLE searched", "not a session"},
           {"CREATE TABLE more(a)", "not a session"},
           {"CREATE VIEW more AS SELECT * FROM parts", "not a session"},
           {"CREATE INDEX more ON edges(kind)", "not a session"},
           {"CREATE TRIGGER more AFTER INSERT ON parts BEGIN DELETE FROM frames; END", "not a session"},
           {"DROP TABLE poses; CREATE VIEW poses AS SELECT 1 AS keyframe, 1 AS in_map, 2 AS pose",
            "not a session"},
           {"ALTER TABLE edges ADD COLUMN more GENERATED ALWAYS AS (abs(tentative))", "not a session"}}) {
    write_bytes(file, good);
    sql(file, change);
    EXPECT_THAT(both(), HasSubstr(why)) << change;
  }
}

TEST_F(DamagedStore, AfterItsOwnerHasAnalyzedAndVacuumedItIsRead) {
  sql(file, "ANALYZE; VACUUM");
  EXPECT_EQ(read_scan(folder.path(), {}).frames.size(), 60u);
  EXPECT_FALSE(load_saved_map(folder.path()).nodes.empty());
  Store(folder.path()).add(ScanPart{60, "one", 0, ""});
  EXPECT_EQ(read_scan(folder.path(), {}).parts.size(), 2u);
}

/// SQLite itself would accept the write-ahead log of another file.
TEST_F(DamagedStore, TheWriteAheadLogOfAnotherRunIsRefused) {
  const SlamMap map = small_map();
  for (const char* run : {"a", "b"}) {
    fs::create_directory(folder / run);
    begin_store(folder / run, ScanPart{0, "one", 0, ""});
    Store store(folder / run);
    store.add(map.frames.at(12));
    store.add(NewKeyframe{map.keyframes.at(0), {}});
    for (const char* of : {"session.db", "session.db-wal"})
      fs::copy(folder / run / of, folder / (std::string(run) + "_" + of));
  }
  fs::rename(folder / "a_session.db", file);
  fs::rename(folder / "a_session.db-wal", folder / "session.db-wal");
  EXPECT_EQ(read_scan(folder.path(), {}).keyframes.size(), 1u) << "its own";
  fs::rename(folder / "b_session.db-wal", folder / "session.db-wal");
  EXPECT_THAT(refusal([&] { read_scan(folder.path(), {}); }),
              HasSubstr("session.db-wal beside it is of another run"));
}

/// The program continues the numbers in a session, uses them as indices of keyframes, and composes its poses,
/// so impossible values would do harm.
TEST_F(DamagedStore, NumbersThatNoScanHasAreRefused) {
  const std::string good = read_bytes(file);
  for (const char* change : {
           "UPDATE parts SET first_frame=1000000000001",
           "UPDATE parts SET model_crc32=-1",
           "UPDATE parts SET sensor=NULL",
           "DELETE FROM parts",
           "UPDATE frames SET frame=-1 WHERE frame=0",
           "UPDATE frames SET frame=9223372036854775807 WHERE frame=59",
           "UPDATE frames SET time_s=1e300",
           "UPDATE frames SET time_s=NULL",
           "UPDATE frames SET time_s='now'",
           "UPDATE frames SET status='flying'",
           "UPDATE frames SET trial=2147483647 WHERE frame=59",
           "UPDATE frames SET trial=NULL WHERE frame=59",
           "UPDATE frames SET keyframe=-1 WHERE frame=59",
           "UPDATE frames SET keyframe_T_frame=NULL WHERE frame=59",
           "UPDATE frames SET keyframe_T_frame=x'00' WHERE frame=59",
           "UPDATE frames SET keyframe_T_frame=CAST(zeroblob(96) || x'AE65F4BA' AS BLOB) WHERE frame=59",
           "UPDATE frames SET observable=128",
           "DELETE FROM frames WHERE frame=15",
           "UPDATE keyframes SET id=2592000 WHERE id=2",
           "UPDATE keyframes SET id=-1 WHERE id=0",
           "UPDATE keyframes SET frame=-1 WHERE id=0",
           "UPDATE keyframes SET trial=2147483647 WHERE id=0",
           "UPDATE keyframes SET surface='a surface'",
           "UPDATE keyframes SET surface=zeroblob(200)",
           "UPDATE keyframes SET surface=substr(surface, 1, 200)",
           "UPDATE edges SET from_keyframe=7",
           "UPDATE edges SET from_keyframe=-1",
           "UPDATE edges SET kind='tunnel'",
           "UPDATE edges SET from_T_to=information",
           "UPDATE edges SET information=shared_center_mm",
           "UPDATE edges SET shared_center_mm=x'000000000000F07F000000000000F07F000000000000F07FC248A48D'",
           "UPDATE edges SET shared_center_mm=CAST(x'55' || substr(shared_center_mm, 2) AS BLOB)",
           "UPDATE edges SET tentative=2",
       }) {
    write_bytes(file, good);
    sql(file, change);
    EXPECT_THAT(refusal([&] { read_scan(folder.path(), {}); }), HasSubstr("session.db: ")) << change;
  }
  for (const char* change : {
           "UPDATE map SET gradient_scale=0",
           "UPDATE map SET gradient_scale=NULL",
           "UPDATE map SET last_frame='late'",
           "UPDATE poses SET keyframe=-1 WHERE keyframe=0",
           "UPDATE poses SET in_map=7",
           "UPDATE poses SET pose=CAST(zeroblob(96) || x'AE65F4BA' AS BLOB)",
           "UPDATE poses SET pose=CAST(x'55' || substr(pose, 2) AS BLOB) WHERE NOT in_map",
           "UPDATE frames SET keyframe_T_frame=CAST(x'55' || substr(keyframe_T_frame, 2) AS BLOB)",
           "UPDATE edges SET from_T_to=CAST(x'55' || substr(from_T_to, 2) AS BLOB)",
           "UPDATE poses SET pose=zeroblob(88)",
           "UPDATE keyframes SET surface=zeroblob(200)",
           "INSERT INTO map_edges VALUES(NULL,-1,1,'loop',0)",
           "INSERT INTO map_edges VALUES(NULL,0,1,'tunnel',0)",
       }) {
    write_bytes(file, good);
    sql(file, change);
    EXPECT_THAT(refusal([&] { load_saved_map(folder.path()); }), HasSubstr("session.db: ")) << change;
  }
}

TEST_F(DamagedStore, MoreFramesThanADayHasAreRefused) {
  sql(file,
      "WITH RECURSIVE n(i) AS (VALUES(1000) UNION ALL SELECT i+1 FROM n WHERE i < 2600000) "
      "INSERT INTO frames(frame, time_s, status, observable) SELECT i, i/25.0, 'no_contact', 63 FROM n");
  for (const auto& read : {std::function<void()>([&] { load_saved_map(folder.path()); }),
                           std::function<void()>([&] { read_scan(folder.path(), {}); })})
    EXPECT_THAT(refusal(read), HasSubstr("session.db: holds more frames than a day of scanning makes"));
}

/// If the program is killed, frames or loops may have been written whose keyframe was not, or was removed
/// again.
TEST_F(DamagedStore, WhatLeadsToNoKeyframeIsLeftOut) {
  sql(file,
      "INSERT INTO searched VALUES(7); INSERT INTO edges SELECT NULL,1,7,kind,from_T_to,information,"
      "shared_center_mm,0 FROM edges; UPDATE frames SET keyframe=7 WHERE frame=59");
  const ScanRecord record = read_scan(folder.path(), {});
  EXPECT_EQ(record.edges.size(), 2u);
  EXPECT_EQ(record.frames.back().keyframe, -1);
  Mapper mapper{SlamOptions{}};
  mapper.restore(record);
  EXPECT_GE(solve_scan(mapper.measured(record.frames), {}, false, [] { return false; }).components, 1);
}

}  // namespace
}  // namespace gelslam::test
