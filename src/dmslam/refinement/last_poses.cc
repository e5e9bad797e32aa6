#include "dmslam/refinement/last_poses.h"

#include <algorithm>
#include <iterator>
#include <utility>

#include "dmslam/refinement/lone_poses.h"
#include "dmslam/util/machine.h"

namespace dmslam {
namespace {

constexpr int kMaxThreads = 4;

int NumThreads() { return std::clamp(ThisMachine().cores, 1, kMaxThreads); }

FrameRefinerOptions ForSmoothing(FrameRefinerOptions options, bool smooth) {
  options.for_smoothing = options.for_smoothing || smooth;
  return options;
}

}  // namespace

LastPoses::LastPoses(const FrameRefinerOptions& refiner, bool smooth, const TrackingOptions& tracking,
                     const Camera& camera)
    : refiner_(ForSmoothing(refiner, smooth)),
      final_(NumThreads(), tracking.motion),
      smooth_(smooth),
      max_frames_(refiner.max_frames) {
  const int threads = NumThreads();
  for (int i = 0; i < threads; ++i) searches_.emplace_back(tracking, camera);
}

LastPoses::Tracked LastPoses::PlaceOf(const FramePose& pose) {
  return {pose.frame_index, pose.stamp_ns, {*pose.reference, pose.T_cam_reference, pose.reference_scale}};
}

void LastPoses::Keep(const TrackedFrame& frame, const FramePose& pose) {
  refiner_.Keep(frame, pose);
  tracked_.push_back(PlaceOf(pose));
  if (tracked_.size() > max_frames_) tracked_.pop_front();
}

void LastPoses::KeepEarlier(const TrackedFrame& frame, const FramePose& pose) {
  refiner_.KeepEarlier(frame, pose);
  if (tracked_.size() < max_frames_) tracked_.push_front(PlaceOf(pose));
}

void LastPoses::KeepPlaced(const TrackedFrame& frame, const FramePose& pose, bool vouches) {
  refiner_.Keep(frame, pose);
  if (vouches) placed_.push_back(PlaceOf(pose));
}

std::optional<LatePlacement::Before> LastPoses::TrackedBefore(const Map& map, MapId map_id,
                                                              uint32_t index) const {
  const auto next = std::ranges::lower_bound(tracked_, index, {}, &Tracked::index);
  if (next == tracked_.begin()) return std::nullopt;
  const Tracked& before = *std::prev(next);
  const Keyframe* reference = map.Resolve(before.pose.reference);
  if (before.index + 1 != index || reference == nullptr || reference->map_id != map_id) return std::nullopt;
  return LatePlacement::Before{before.index, before.stamp_ns, *before.pose.In(map)};
}

void LastPoses::RefineNext(const Map& map) {
  std::vector<FrameRefiner::Search> searches;
  for (PoseSearch& search : searches_) {
    searches.emplace_back([&map, &search](TrackedFrame* frame) {
      search.Reset();  // what the frame before saw move may lie still in this one
      return search.FitsLocalMap(map, frame);
    });
  }
  if (!refiner_.IsAhead()) refiner_.LookAhead(map, searches);
  if (auto pose = refiner_.RefineNext(map, searches.front())) final_.Add(map, std::move(*pose));
}

/// To be smoothed: by what it sees alone, without what was expected of it; nothing is known where that does
/// not agree.
void LastPoses::AddPlaced(const Map& map, const TrackedFrame& frame, const FramePose& pose, bool vouches) {
  if (vouches) placed_.push_back(PlaceOf(pose));
  FinalPose later;
  later.pose = pose;
  const PoseOptimizationReport report = MeasureCheckedPose(map, frame.T_cam_world, SightsOf(frame), &later);
  if (!Agrees(report)) {
    later.measured = frame.T_cam_world;
    later.information.setZero();
  }
  later.SetPose(map.At(*pose.reference), smooth_ ? later.measured : frame.T_cam_world);
  final_.Add(map, std::move(later));
}

/// Frames of a map that was dropped vouch for nothing.
std::vector<FramePose> LastPoses::Take(const Map& map) {
  std::vector<TrackedAt> tracked;
  const auto add = [&](const Tracked& frame) {
    if (const Keyframe* reference = map.Resolve(frame.pose.reference))
      tracked.push_back({frame.stamp_ns, reference->map_id});
  };
  std::ranges::for_each(tracked_, add);
  std::ranges::for_each(placed_, add);
  std::ranges::sort(tracked, {}, &TrackedAt::stamp_ns);
  final_.Drop(StandAlone(final_.poses(), tracked));
  return final_.Take();
}

bool LastPoses::Improve(const Map& map) {
  if (!smooth_ || final_.IsSettled()) return false;
  final_.Improve(map);
  return true;
}

}  // namespace dmslam
