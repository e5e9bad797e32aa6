#include "dmslam/initialization/reference_windows.h"

#include <algorithm>
#include <utility>
#include <vector>

namespace dmslam {

void ReferenceWindows::KeepRecent(const InitializerFrame& frame) {
  recent_.push_back(frame);
  while (SecondsFromTo(recent_.front(), frame) > past_.seconds) recent_.pop_front();
}

void ReferenceWindows::DropOld(const InitializerFrame& frame) {
  std::erase_if(windows_, [&](const ReferenceWindow& window) {
    if (window.IsBrief()) return window.AgeAt(frame) > options_.max_brief_age_s;
    return window.AgeAt(frame) > (window.IsPromising() ? options_.max_promising_age_s : options_.max_age_s);
  });
}

std::deque<ReferenceWindow>::iterator ReferenceWindows::Lose(std::deque<ReferenceWindow>::iterator window,
                                                             const InitializerFrame& frame) {
  if (window->AgeAt(frame) <= options_.max_brief_age_s) lost_soon_ns_ = frame.stamp_ns;
  return windows_.erase(window);
}

void ReferenceWindows::BeginIfDue(const InitializerFrame& frame) {
  const auto has_passed_since = [&](const auto& last, double seconds) {
    return last == windows_.rend() || last->AgeAt(frame) >= seconds;
  };
  const auto newest = windows_.rbegin();
  const auto newest_kept =
      std::find_if(newest, windows_.rend(), [](const ReferenceWindow& window) { return !window.IsBrief(); });
  if (has_passed_since(newest_kept, options_.step_s) && MakeRoom()) {
    Begin(frame);
  } else if (BriefOnesHelp(frame) && has_passed_since(newest, options_.brief_step_s)) {
    Begin(frame, ReferenceWindow::Kind::kBrief);
  }
}

bool ReferenceWindows::BriefOnesHelp(const InitializerFrame& frame) const {
  return lost_soon_ns_ && SecondsFromTo(*lost_soon_ns_, frame) <= options_.max_age_s;
}

/// False where there is none. The oldest window that is neither promising nor leads a contest goes.
bool ReferenceWindows::MakeRoom() {
  const auto kept = [](const ReferenceWindow& window) { return !window.IsBrief(); };
  while (std::count_if(windows_.begin(), windows_.end(), kept) >= options_.most) {
    const auto idle = std::find_if(windows_.begin(), windows_.end(), [&](const ReferenceWindow& window) {
      return kept(window) && !window.IsPromising() && !window.lead();
    });
    if (idle == windows_.end()) return false;
    windows_.erase(idle);
  }
  return true;
}

void ReferenceWindows::Begin(const InitializerFrame& frame, ReferenceWindow::Kind kind) {
  std::vector<InitializerFrame> before, past;
  for (const InitializerFrame& each : recent_) {
    if (SecondsFromTo(each, frame) <= past_.seconds && each.index != frame.index) before.push_back(each);
  }
  const size_t asked = std::min(before.size(), static_cast<size_t>(std::max(0, past_.views)));
  for (size_t k = 0; k < asked; ++k) past.push_back(before[k * before.size() / asked]);
  windows_.emplace_back(frame, std::move(past), kind);
}

}  // namespace dmslam
