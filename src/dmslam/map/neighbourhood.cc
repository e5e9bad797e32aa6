#include "dmslam/map/neighbourhood.h"

#include <algorithm>

namespace dmslam {

std::vector<LandmarkId> LandmarksSeenBy(const Map& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<LandmarkId> ids;
  for (const KeyframeId id : keyframes) {
    for (const LandmarkId landmark : map.At(id).landmarks) {
      if (landmark.valid()) ids.push_back(landmark);
    }
  }
  std::sort(ids.begin(), ids.end());
  ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
  return ids;
}

std::vector<LandmarkId> LandmarksAround(const Map& map, KeyframeId id, int neighbours, int min_shared) {
  std::vector<KeyframeId> keyframes = map.BestCovisible(id, neighbours, min_shared);
  keyframes.push_back(id);
  return LandmarksSeenBy(map, keyframes);
}

}  // namespace dmslam
