#pragma once

#include <cstdint>
#include <optional>
#include <variant>

#include "dmslam/map/proposals.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// Where the frontend is between having no map and tracking in one:
///
///   NotInitialized --Propose--> WaitingForMap --BeginTrial--> Trial --OnTracked--> Tracking
///   Trial: a frame that contradicts the map gives it up; one that does not show it ends the trial.
///   Tracking, Missing, Lost: OnTracked and OnMissing go from any of them to any.
///   GiveUpMap: from all of them to NotInitialized.     BeginLost: in a map that is there already.
class TrackingPhase {
 public:
  TrackingState state() const;
  bool IsSearching() const { return Is<NotInitialized>(); }
  bool IsWaiting() const { return Is<WaitingForMap>(); }
  bool IsTrial() const { return Is<Trial>(); }
  /// Whether there is a map to track in.
  bool HasMap() const { return !IsSearching() && !IsWaiting(); }
  /// `second` of the first map that was proposed; none: it is not waited for one.
  std::optional<KeyframeId> awaited_second() const;
  /// Whether the mapper has refused the first map that is waited for.
  bool IsRefused() const;

  /// A first map was proposed.
  void Propose(KeyframeId second);
  /// The mapper refused the first map with this `second`. Of another one than is waited for it means nothing.
  void OnRefused(KeyframeId second);
  /// It has come, and must predict the frames until then.
  void BeginTrial(int64_t until_ns);
  void BeginLost();
  void OnTracked(int64_t stamp_ns);
  /// A frame was not tracked, `since_ns` after the last one that was.
  void OnMissing(int64_t since_ns);
  void GiveUpMap();

 private:
  struct NotInitialized {};
  struct WaitingForMap {
    KeyframeId second;
    bool refused = false;
  };
  struct Trial {
    int64_t until_ns = 0;
  };
  struct Tracking {};
  struct Missing {};
  struct Lost {};

  template <typename T>
  bool Is() const {
    return std::holds_alternative<T>(phase_);
  }

  std::variant<NotInitialized, WaitingForMap, Trial, Tracking, Missing, Lost> phase_;
};

}  // namespace dmslam
