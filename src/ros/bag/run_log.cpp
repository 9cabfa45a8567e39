#include "run_log.h"

namespace rio_t {

void RunLog::addState(const NavigationState& state) {
  if (output_ != nullptr) output_->addState(state);
  trajectory_.push_back({state.time, state.p_W, state.q_WI});
}

void RunLog::addResult(ScanResult& result) {
  if (taken_off_ != 0.0) {
    result.scan.stamp = result.scan.stamp + taken_off_;
    if (result.updated) result.time_offset += taken_off_;
  }
  if (output_ != nullptr) output_->addResult(result);
  for (const StampedPose& pose : result.left_window) {
    if (newest_optimized_) path_length_m_ += (pose.p_W - newest_optimized_->p_W).norm();
    newest_optimized_ = pose;
  }
  if (result.used) {
    ++used_;
  } else if (!result.rejected_because.empty()) {
    ++rejected_[result.rejected_because];
  }
  if (result.updated) {
    ++terminations_[result.solver_termination];
    final_offset_s_ = result.time_offset;
    final_offset_sigma_s_ = result.time_offset_sigma;
  }
}

void RunLog::fill(RunSummary* summary) const {
  summary->scans_used = used_;
  summary->scans_rejected = rejected_;
  for (const auto& [termination, count] : terminations_)
    summary->solver_terminations[toString(termination)] = count;
  summary->path_length_m = path_length_m_;
  summary->final_offset_s = final_offset_s_;
  summary->final_offset_sigma_s = final_offset_sigma_s_;
  if (trajectory_.empty()) return;
  const Eigen::Vector3d moved = trajectory_.back().p_W - trajectory_.front().p_W;
  summary->end_to_start_2d_m = moved.head<2>().norm();
  summary->end_to_start_3d_m = moved.norm();
}

}  // namespace rio_t
