#include "dmslam/wire/streams.h"

#include <map>

#include "dmslam/messaging/camera_channels.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/channels.h"

namespace dmslam {

const StreamPlan& PlanOf(StreamId stream) {
  static const std::map<StreamId, StreamPlan> kPlans = {
      {StreamId::kFrontend,
       {.writer = roles::kFrontend,
        .records = {channels::kSession, channels::kInitialMap, channels::kKeyframe, channels::kFramePose,
                    channels::kFrameEvidence, channels::kMapReset, channels::kAdjustRequest,
                    channels::kTurnRequest},
        .readers = {roles::kMapper, roles::kCollector},
        .watchers = {roles::kViewer}}},
      {StreamId::kMap,
       {.writer = roles::kMapper,
        .records = {channels::kMap},
        .readers = {roles::kFrontend, roles::kLoopCloser, roles::kCollector},
        .watchers = {roles::kViewer}}},
      {StreamId::kLoopCloser,
       {.writer = roles::kLoopCloser,
        .records = {channels::kChecked},
        .readers = {roles::kMapper},
        .watchers = {roles::kViewer}}}};
  const auto plan = kPlans.find(stream);
  DMSLAM_CHECK(plan != kPlans.end(), "a stream without a plan");
  return plan->second;
}

std::vector<std::string> ReadersOf(StreamId stream, CameraId num_cameras) {
  std::vector<std::string> readers;
  for (const std::string& role : PlanOf(stream).readers) {
    const CameraId cameras = role == roles::kFrontend ? num_cameras : CameraId{1};
    for (CameraId camera = 0; camera < cameras; ++camera) readers.push_back(OfCamera(role, camera));
  }
  return readers;
}

}  // namespace dmslam
