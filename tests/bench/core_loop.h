#pragma once

#include <cstdint>
#include <ctime>
#include <memory>
#include <vector>

#include "dmslam/loops/loopcloser_core.h"
#include "dmslam/mapping/mapper_core.h"
#include "dmslam/settings/settings.h"
#include "dmslam/slam/frontend_core.h"

namespace dmslam::bench {

/// Milliseconds that this process has worked since the watch was made, adjustments on threads of their own
/// included: what else the machine does is not counted.
class Stopwatch {
 public:
  double ms() const { return Now() - start_; }

 private:
  static double Now() {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return 1e3 * static_cast<double>(now.tv_sec) + 1e-6 * static_cast<double>(now.tv_nsec);
  }

  double start_ = Now();
};

/// What a frame cost each core [ms].
struct StepTimes {
  double frontend = 0;
  bool keyframe = false;      ///< the rest is of a keyframe
  double to_landmarks = 0;    ///< mapper: from the keyframe to its landmarks
  double to_adjusted = 0;     ///< mapper: to its local bundle adjustment
  double mapper = 0;          ///< mapper: all of it
  double check = 0;           ///< loop closer
  double replica_update = 0;  ///< frontend: the records that the keyframe caused
};

/// What the end of a run takes on the clock, since several cores share its work [s].
struct EndTimes {
  double adjustment = 0;  ///< mapper: of all maps
  double all = 0;         ///< with the growth before it and the last poses after it
};

/// The cores of frontend, mapper and loop closer in lock-step, without processes, messages or a clock.
class CoreLoop {
 public:
  CoreLoop(const Settings& settings, const Camera& camera,
           const std::shared_ptr<const Vocabulary>& vocabulary);

  StepTimes StepImage(uint32_t index, int64_t stamp_ns, const GrayView& image);
  StepTimes StepFeatures(uint32_t index, int64_t stamp_ns, FeatureSet features);
  /// No frame follows.
  EndTimes End();

  const FrontendCore& frontend() const { return frontend_; }
  const Map& map() const { return mapper_.map(); }

 private:
  StepTimes AfterFrame(const FrontendOutput& output, double frontend_ms);
  void TellFrontend();
  void OnDelta(const MapDelta& delta);
  void TellLoopCloser();
  void Settle(KeyframeId id, MapId map_id, StepTimes* times);

  FrontendCore frontend_;
  MapperCore mapper_;
  LoopcloserCore loopcloser_;
  std::vector<MapDelta> deltas_;  ///< that this frame caused
  size_t told_ = 0;               ///< of them, to the loop closer
  Stopwatch keyframe_watch_;
  StepTimes* times_ = nullptr;  ///< of the keyframe in work
};

}  // namespace dmslam::bench
