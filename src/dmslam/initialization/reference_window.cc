#include "dmslam/initialization/reference_window.h"

#include <algorithm>
#include <iterator>

#include "dmslam/geometry/rigid3.h"

namespace dmslam {

std::vector<const ReferenceView*> ReferenceWindow::PairsToAgree(int num_pairs, double min_step_s) const {
  std::vector<const ReferenceView*> moved, chosen;
  for (const ReferenceView& view : views_) {
    if (view.moved) moved.push_back(&view);
  }
  const auto asked = static_cast<size_t>(num_pairs);
  if (num_pairs < 1 || moved.size() < asked) return chosen;
  const double span_s = SecondsFromTo(moved.front()->frame, moved.back()->frame);
  if (span_s < min_step_s * static_cast<double>(asked - 1)) return chosen;
  if (asked == 1) return {moved.back()};
  for (size_t k = 0; k < asked; ++k) chosen.push_back(moved[k * (moved.size() - 1) / (asked - 1)]);
  return chosen;
}

Eigen::Quaterniond ReferenceWindow::TurnAt(double since_reference_s) const {
  if (views_.empty()) return Eigen::Quaterniond::Identity();
  const size_t newer = since_reference_s < 0 ? 0 : views_.size() - 1;
  const ReferenceView& b = views_[newer];
  Eigen::Quaterniond R_a_0 = Eigen::Quaterniond::Identity();
  double time_a_s = 0;
  if (newer > 0) {
    R_a_0 = views_[newer - 1].R_k_0;
    time_a_s = views_[newer - 1].since_reference_s;
  }
  const Eigen::Vector3d rate = LogSo3(b.R_k_0 * R_a_0.conjugate()) / (b.since_reference_s - time_a_s);
  return ExpSo3(rate * (since_reference_s - b.since_reference_s)) * b.R_k_0;
}

std::vector<const ReferenceView*> ReferenceWindow::ViewsBetween(const ReferenceView& last, int most) const {
  std::vector<const ReferenceView*> all;
  for (const ReferenceView& view : views_) {
    if (&view != &last && !view.pair.matches.empty()) all.push_back(&view);
  }
  const auto kept = static_cast<size_t>(std::max(0, most));
  if (all.size() <= kept) return all;
  std::vector<const ReferenceView*> chosen;
  for (size_t k = 0; k < kept; ++k) chosen.push_back(all[k * all.size() / kept]);
  return chosen;
}

int64_t ReferenceWindow::OnContestWon(int64_t stamp_ns, std::vector<uint32_t> features, double min_overlap) {
  int64_t since_ns = stamp_ns;
  if (lead_) {
    const std::vector<uint32_t>& before = lead_->features;
    std::vector<uint32_t> common;
    std::set_intersection(before.begin(), before.end(), features.begin(), features.end(),
                          std::back_inserter(common));
    const double smaller = static_cast<double>(std::min(before.size(), features.size()));
    if (static_cast<double>(common.size()) >= min_overlap * smaller) since_ns = lead_->since_ns;
  }
  lead_ = Lead{since_ns, std::move(features)};
  return since_ns;
}

void ReferenceWindow::OnExplained(const CandidateMap& best, const std::optional<CandidateMap>& runner_up) {
  hypotheses_ = {best};
  if (runner_up) hypotheses_.push_back(*runner_up);
}

void ReferenceWindow::OnTried(WaitReason wait) {
  if (wait == WaitReason::kNoReconstruction) {
    found_.reset();
    doubtful_ = true;
  }
  promising_ = wait == WaitReason::kParallaxTooSmall || wait == WaitReason::kNoReconstruction ||
               wait == WaitReason::kOnTrial;
}

}  // namespace dmslam
