#include "dmslam/slam/first_map_phase.h"

#include <memory>

#include "dmslam/initialization/baseline_initializer.h"
#include "dmslam/initialization/initial_map.h"

namespace dmslam {

FirstMapSearch MakeFirstMapSearch(const std::string& method, const InitializerOptions& options,
                                  const Camera& camera, uint64_t seed) {
  if (method == "ransac") {
    auto baseline = std::make_shared<BaselineInitializer>(BaselineInitializerOptions(), camera, seed);
    return [baseline](const InitializerFrame& frame) { return baseline->AddFrame(frame); };
  }
  InitializerOptions chosen = options;
  chosen.method = method;
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
