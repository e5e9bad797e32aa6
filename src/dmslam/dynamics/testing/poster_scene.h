#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <optional>
#include <vector>

#include "dmslam/dynamics/frame_expectation.h"
#include "dmslam/map/testing/map_scene.h"

namespace dmslam::testing {

/// A wall at depth 4 and a poster, say, of 5 x 5 points before it at depth 2; and frames that see them.
class PosterScene {
 public:
  static constexpr size_t kPoster = 300, kPosterPoints = 25;  ///< the wall's points come first
  static constexpr int64_t kNow = 10'000'000'000;

  PosterScene() {
    scene_.AddCloud(kPoster, {0, 0, 4}, {1.6, 1.2, 0.01});
    for (int x = -2; x <= 2; ++x) {
      for (int y = -2; y <= 2; ++y) scene_.AddPoint({0.08 * x, 0.08 * y, 2.0});
    }
    scene_.MapAll();
  }

  static bool OfPoster(size_t point) { return point >= kPoster; }
  static bool IsOfPoster(LandmarkId id) { return OfPoster(id.number() - 1); }

  MapEditor& map() { return scene_.map(); }
  const MapEditor& map() const { return scene_.map(); }
  const Eigen::Vector3d& point(size_t i) const { return scene_.point(i); }
  size_t size() const { return scene_.size(); }

  std::vector<ExpectedLandmark> ExpectAll(const TrackedFrame& frame) const {
    std::vector<ExpectedLandmark> expected;
    for (size_t i = 0; i < scene_.size(); ++i) {
      const Landmark& landmark = *scene_.map().FindLandmark(MapScene::IdOf(i));
      if (const auto view = PredictView(scene_.map(), landmark, frame.T_cam_world))
        expected.push_back({&landmark, *view});
    }
    return expected;
  }

  /// What a frame sees where `place` says points are now; those for which `found` says so are matched.
  TrackedFrame Frame(const MapScene::Place& place, const std::function<bool(size_t)>& found) const {
    std::vector<size_t> shown;
    TrackedFrame frame = scene_.See(100, kNow, MapScene::PoseAt(0.1), place, &shown);
    for (size_t feature = 0; feature < shown.size(); ++feature) {
      if (!found(shown[feature])) continue;
      frame.landmarks[feature] = MapScene::IdOf(shown[feature]);
      frame.classes[feature] = FeatureClass::kUsed;
    }
    return frame;
  }
  /// A frame that finds these points where they are, and does not see the others.
  TrackedFrame Found(const std::function<bool(size_t)>& found) const {
    return Frame([&](size_t i) { return found(i) ? std::optional(scene_.point(i)) : std::nullopt; },
                 [](size_t) { return true; });
  }

 private:
  MapScene scene_;
};

}  // namespace dmslam::testing
