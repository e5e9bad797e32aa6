#include "dmslam/slam/first_map_phase.h"

#include <memory>
#include <utility>

#include "dmslam/initialization/initial_map.h"
#include "dmslam/initialization/two_frame_initializer.h"

namespace dmslam {
namespace {

constexpr double kPaperGapS = 0.15;  // between the two frames; the paper: some frames

template <typename AnyInitializer>
FirstMapSearch SearchBy(std::shared_ptr<AnyInitializer> initializer) {
  return [initializer](const InitializerFrame& frame) { return initializer->AddFrame(frame); };
}

}  // namespace

FirstMapSearch MakeFirstMapSearch(FirstMapMethod method, const InitializerOptions& options,
                                  const Camera& camera, const Pyramid& pyramid, uint64_t seed) {
  const auto by_selector = [&](SelectorMethod selector) {
    InitializerOptions of_pyramid = options;
    of_pyramid.SetPyramid(pyramid);
    return SearchBy(
        std::make_shared<Initializer>(of_pyramid, camera, seed, AdjustInitialMap(camera.Ideal()), selector));
  };
  const auto by_two_frames = [&](double min_gap_s, ReconstructPair reconstruct) {
    TwoFrameOptions apart;
    apart.min_gap_s = min_gap_s;
    return SearchBy(std::make_shared<TwoFrameInitializer>(apart, camera, std::move(reconstruct), seed));
  };
  switch (method) {
    case FirstMapMethod::kDlrsac:
      break;
    case FirstMapMethod::kArsac:
      return by_selector(SelectorMethod::kArsac);
    case FirstMapMethod::kTwoFrameRansac:
      return by_two_frames(0, ReconstructByRansac(camera, pyramid));
    case FirstMapMethod::kTwoFramePaper:
      return by_two_frames(kPaperGapS, ReconstructByPaper(camera, pyramid));
  }
  return by_selector(SelectorMethod::kDlrsac);
}

FirstMapPhase::Answer FirstMapPhase::AddFrame(const TrackedFrame& frame, uint32_t session, CameraId camera_id,
                                              MapId map_id) {
  const InitializerReport report = search_({frame.index, frame.stamp_ns, frame.features});
  if (!report.result) return {std::nullopt, report.reason};
  return {MakeInitialMap(*report.result, session, camera_id, map_id), "a first map was proposed"};
}

}  // namespace dmslam
