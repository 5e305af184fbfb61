#include "gelslam/slam/status_text.hpp"

#include <gtest/gtest.h>

namespace gelslam {
namespace {

LiveStatus saying(LivePhase phase, const std::string& state = "", const std::string& reason = "",
                  const std::string& advice = "", TrackStatus track = TrackStatus::tracked) {
  LiveStatus status;
  status.track = track;
  status.phase = phase;
  status.state = state;
  status.reason = reason;
  status.advice = advice;
  return status;
}

TEST(StateWords, SayWhatIsWrongAndWhatToDo) {
  const LiveStatus lost = saying(LivePhase::scanning, "lost", "too little overlap",
                                 "touch a place you have seen", TrackStatus::lost);
  EXPECT_EQ(state_line(lost), "lost: too little overlap; touch a place you have seen");
  const StateWords words = state_words(lost);
  EXPECT_EQ(words.state, "lost");
  EXPECT_EQ(words.headline, "Lost");
  EXPECT_EQ(words.advice, "Too little overlap. Touch a place you have seen.");
}

TEST(StateWords, GiveTheUsualAdviceWhereTheSessionGivesNone) {
  EXPECT_EQ(state_words(saying(LivePhase::scanning, "lost", "", "", TrackStatus::lost)).advice,
            "Touch a place you have seen.");
  EXPECT_EQ(state_words(saying(LivePhase::scanning, "no contact", "", "", TrackStatus::no_contact)).headline,
            "No contact");
  EXPECT_EQ(state_words(saying(LivePhase::scanning, "no contact", "", "", TrackStatus::no_contact)).advice,
            "Press the object on the gel.");
  EXPECT_EQ(state_words(saying(LivePhase::scanning, "tracking")).advice, "");
  EXPECT_EQ(state_words(saying(LivePhase::scanning, "tracking", "twisting is not observable")).advice,
            "Twisting is not observable.");
  EXPECT_EQ(state_words(saying(LivePhase::paused)).advice, "Press Space to go on.");
  EXPECT_EQ(state_words(saying(LivePhase::paused), false).advice, "") << "without the window's keys";
  LiveStatus finished = saying(LivePhase::finished);
  EXPECT_EQ(state_words(finished, false).advice, "Nothing is kept (no -o).");
  finished.is_scan = false;
  EXPECT_EQ(state_words(finished, false).advice, "") << "tracking has no -o";
}

TEST(StateWords, ClaimNothingThatIsNotSaved) {
  LiveStatus status = saying(LivePhase::finished, "saving");
  status.run_folder = "RUN";
  EXPECT_EQ(state_words(status).advice, "Everything is saved. Look around; Q closes.");
  status.failure = "run/mesh.ply: cannot be written: No space left on device";
  EXPECT_EQ(state_words(status).tone, Tone::red);
  EXPECT_EQ(state_words(status).headline, "Ended with an error");
  EXPECT_EQ(state_words(status).advice, "Not all may be saved. Q closes.");
  status.log_bytes = 1000;
  EXPECT_NE(state_words(status).advice.find("gelslam reconstruct makes it from the log"), std::string::npos);
}

TEST(StateWords, AreAmberWhereTheMeshIsNotWholeOrAMotionIsNotObservable) {
  EXPECT_EQ(state_words(saying(LivePhase::scanning, "tracking")).tone, Tone::green);
  EXPECT_EQ(state_words(saying(LivePhase::scanning, "tracking", "", "return to the start")).tone,
            Tone::green);
  const StateWords unsure =
      state_words(saying(LivePhase::scanning, "tracking", "sliding along x is not observable"));
  EXPECT_EQ(unsure.tone, Tone::amber);
  EXPECT_EQ(unsure.state, "tracking");
  EXPECT_EQ(unsure.headline, "Position uncertain");
  LiveStatus status = saying(LivePhase::finished);
  status.run_folder = "RUN";
  status.touched = "3.2 cm² touched, 90 % of it in the mesh; 10 % not joined";
  EXPECT_EQ(state_words(status).tone, Tone::green);
  EXPECT_EQ(state_words(status, false).advice,
            "Everything is saved. 3.2 cm² touched, 90 % of it in the mesh. 10 % not joined.");
  status.result_warnings = {
      "1 component not joined; 16 frames not in the mesh; next time cross places that you touched before",
      "poses may be off by 2 mm"};
  EXPECT_EQ(state_words(status).tone, Tone::amber);
  EXPECT_EQ(
      state_words(status).advice,
      "Saved. 3.2 cm² touched, 90 % of it in the mesh. 10 % not joined. 1 component not joined. 16 frames "
      "not in the mesh. Next time cross places that you touched "
      "before. Poses may be off by 2 mm. Q closes.");
}

}  // namespace
}  // namespace gelslam
