#include "live/live_window.hpp"

namespace gelslam::viewer::detail {
namespace {

std::vector<ActionRow> live_rows() {
  using enum Action;
  std::vector<ActionRow> rows = {
      {pause, {GLFW_KEY_SPACE}, "Space", "Pause", 0, 1, "Pause, go on"},
      {new_scan, {GLFW_KEY_N}, "N", "New scan", 0, 5, "Finish this scan and begin another (asks first)"},
      {close, {GLFW_KEY_Q, GLFW_KEY_ESCAPE}, "Q", "Stop", 0, 0, "Stop and save (asks first)"},
      common_row(screenshot),
      common_row(follow),
  };
  for (const Action action :
       {show_all, trajectory, pose_graph, not_in_mesh, next_color, curvature, panels, help})
    rows.push_back(common_row(action));
  rows.push_back({diagnostics, {GLFW_KEY_I}, "I", "", 0, 0, "Diagnostics"});
  return rows;
}

Answer yes(const std::string& label, std::function<void(double)> run) {
  return {label, {GLFW_KEY_ENTER, GLFW_KEY_KP_ENTER, GLFW_KEY_Y}, "Enter", theme::kBlue, std::move(run)};
}
Answer no(const std::string& label) {
  return {label, {GLFW_KEY_ESCAPE, GLFW_KEY_N}, "Esc", theme::kText, {}};
}

}  // namespace

LiveControls::LiveControls(LiveSession& session, bool keeps_run, std::string next_run_folder)
    : SceneControls(live_rows(), {.color = SceneColor::certainty},
                    {SceneColor::certainty, SceneColor::plain, SceneColor::confidence, SceneColor::height}),
      session_(session),
      keeps_run_(keeps_run),
      next_run_folder_(std::move(next_run_folder)) {}

void LiveControls::act(Action action, double now_s) {
  if (action == Action::pause) return toggle_pause(now_s);
  if (action == Action::new_scan) return ask_for_new_scan(now_s);
  if (action == Action::close) return ask_to_close();
  if (action == Action::diagnostics) shows_diagnostics_ = !shows_diagnostics_;
  SceneControls::act(action, now_s);
}

ButtonLook LiveControls::button(const ActionRow& row) const {
  const LivePhase phase = session_.status().phase;
  const bool over = phase == LivePhase::finishing || phase == LivePhase::finished;
  ButtonLook look = SceneControls::button(row);
  if (row.action == Action::pause && phase == LivePhase::paused) look.label = "Go on";
  if (row.action == Action::pause || row.action == Action::follow) look.shown = !over;
  if (row.action == Action::not_in_mesh) look.shown = phase == LivePhase::finished;
  if (row.action == Action::new_scan) look.shown = phase != LivePhase::finishing && !next_run_folder_.empty();
  if (row.action == Action::close) {
    look.ink = theme::kRed;
    if (over) look.label = "Close";
  }
  return look;
}

void LiveControls::toggle_pause(double now_s) {
  const LivePhase phase = session_.status().phase;
  if (phase == LivePhase::finishing || phase == LivePhase::finished)
    return complain("The scan is over: too late to pause.", now_s);
  const bool paused = phase == LivePhase::paused;
  session_.set_paused(!paused);
  say(paused ? "Going on." : "Paused.", now_s);
}

void LiveControls::ask_to_close() {
  const LiveStatus status = session_.status();
  if (status.phase == LivePhase::finished) return close();
  if (status.phase == LivePhase::finishing)
    return ask({"Close the window?",
                "The scan is still being saved. That goes on without the window.",
                {yes("Close",
                     [this](double) {
                       wants_new_scan_ = false;
                       close();
                     }),
                 no("Wait here")}});
  const std::string sentence =
      keeps_run_ ? "Loops are closed, the mesh is made, and everything is saved in " + status.run_folder + "."
                 : "Loops are closed and the mesh is made, but nothing is kept (no -o).";
  ask({"Stop the scan?",
       sentence,
       {yes(keeps_run_ ? "Stop and save" : "Stop",
            [this](double now_s) {
              session_.stop();
              say("Stopping: loops are closed, and the mesh is made.", now_s);
            }),
        no("Go on scanning")}});
}

void LiveControls::ask_for_new_scan(double now_s) {
  const LiveStatus status = session_.status();
  const std::string why = refusal(ScanCommand::new_scan, status, !next_run_folder_.empty());
  if (!why.empty()) return complain(why, now_s);
  const LivePhase phase = status.phase;
  if (phase == LivePhase::finished) {
    wants_new_scan_ = true;
    return close();
  }
  const auto start = [this](double then_s) {
    wants_new_scan_ = true;
    session_.stop();
    say("The new scan begins when this one is saved.", then_s);
  };
  if (phase == LivePhase::finishing) return start(now_s);
  ask({"Start a new scan?",
       "This one is finished and saved first. The new one goes to " + next_run_folder_ +
           ", with the same background.",
       {yes("Save and start", start), no("Go on scanning")}});
}

}  // namespace gelslam::viewer::detail
