#pragma once

#include <cstdint>
#include <deque>
#include <optional>

#include "dmslam/initialization/initializer_options.h"
#include "dmslam/initialization/reference_window.h"

namespace dmslam {

/// The reference frames that are kept side by side: which are begun, and how long they are kept.
class ReferenceWindows {
 public:
  ReferenceWindows(const ReferenceOptions& options, const PastOptions& past)
      : options_(options), past_(past) {}

  std::deque<ReferenceWindow>& all() { return windows_; }  ///< the oldest first
  const std::deque<ReferenceWindow>& all() const { return windows_; }
  bool empty() const { return windows_.empty(); }

  /// `frame` becomes a reference frame; those kept just before it are its past.
  void Begin(const InitializerFrame& frame, ReferenceWindow::Kind kind = ReferenceWindow::Kind::kLasting);
  /// The same where it is due. Between the reference frames that are kept there are brief ones, where
  /// reference frames last no longer.
  void BeginIfDue(const InitializerFrame& frame);
  /// `frame` may be of a coming reference frame's past.
  void KeepRecent(const InitializerFrame& frame);
  void DropOld(const InitializerFrame& frame);
  /// At `frame` the window at `window` shows too little of its reference frame. Returns the next one.
  std::deque<ReferenceWindow>::iterator Lose(std::deque<ReferenceWindow>::iterator window,
                                             const InitializerFrame& frame);
  /// What a reference frame showed was lost sight of soon, a moment ago. Elsewhere brief ones would cost time
  /// and find nothing that the others do not find.
  bool BriefOnesHelp(const InitializerFrame& frame) const;

 private:
  bool MakeRoom();

  ReferenceOptions options_;
  PastOptions past_;
  std::deque<ReferenceWindow> windows_;  ///< the oldest first
  std::deque<InitializerFrame> recent_;  ///< what the next reference frame's past will be
  std::optional<int64_t> lost_soon_ns_;  ///< when a reference frame was lost sight of soon, the last time
};

}  // namespace dmslam
