#include "dmslam/slam/first_map_phase.h"

#include <memory>
#include <utility>

#include "dmslam/initialization/initial_map.h"
#include "dmslam/initialization/two_frame_initializer.h"

namespace dmslam {
namespace {

constexpr double kPaperGapS = 0.15;  // between the two frames; the paper: some frames

FirstMapSearch Search(TwoFrameInitializer initializer) {
  auto shared = std::make_shared<TwoFrameInitializer>(std::move(initializer));
  return [shared](const InitializerFrame& frame) { return shared->AddFrame(frame); };
}

}  // namespace

FirstMapSearch MakeFirstMapSearch(const std::string& method, const InitializerOptions& options,
                                  const Camera& camera, const Pyramid& levels, uint64_t seed) {
  const Pyramid pyramid = levels.OfImages(camera.width_px, camera.height_px);
  if (method == "ransac") {
    return Search(TwoFrameInitializer({}, camera, ReconstructByRansac(camera, pyramid), seed));
  }
  if (method == "paper") {
    TwoFrameOptions some_frames_apart;
    some_frames_apart.min_gap_s = kPaperGapS;
    return Search(TwoFrameInitializer(some_frames_apart, camera, ReconstructByPaper(camera, pyramid), seed));
  }
  InitializerOptions chosen = options;
  chosen.method = method;
  chosen.selector.inlier.pyramid = pyramid;
  chosen.reconstruction.pyramid = pyramid;
  auto initializer = std::make_shared<Initializer>(chosen, camera, seed, AdjustInitialMap(camera.Ideal()));
  return [initializer](const InitializerFrame& frame) { return initializer->AddFrame(frame); };
}

FirstMapPhase::Answer FirstMapPhase::AddFrame(const TrackedFrame& frame, uint32_t session, CameraId camera_id,
                                              MapId map_id) {
  const InitializerReport report = search_({frame.index, frame.stamp_ns, frame.features});
  if (!report.result) return {std::nullopt, report.reason};
  return {MakeInitialMap(*report.result, session, camera_id, map_id), "a first map was proposed"};
}

}  // namespace dmslam
