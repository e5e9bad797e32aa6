#include "dmslam/map/neighbourhood.h"

#include <algorithm>

namespace dmslam {

namespace {

void AppendSeenBy(const Keyframe& keyframe, std::vector<LandmarkId>* ids) {
  for (const LandmarkId id : keyframe.landmarks) {
    if (id.valid()) ids->push_back(id);
  }
}

void SortUnique(std::vector<LandmarkId>* ids) {
  std::sort(ids->begin(), ids->end());
  ids->erase(std::unique(ids->begin(), ids->end()), ids->end());
}

}  // namespace

std::vector<LandmarkId> LandmarksSeenBy(const Map& map, const std::vector<KeyframeId>& keyframes) {
  std::vector<LandmarkId> ids;
  for (const KeyframeId id : keyframes) AppendSeenBy(map.At(id), &ids);
  SortUnique(&ids);
  return ids;
}

std::vector<const Landmark*> LandmarksSeenBy(const Map& map, const std::vector<const Keyframe*>& keyframes) {
  std::vector<LandmarkId> ids;
  for (const Keyframe* keyframe : keyframes) AppendSeenBy(*keyframe, &ids);
  SortUnique(&ids);
  std::vector<const Landmark*> landmarks;
  landmarks.reserve(ids.size());
  for (const LandmarkId id : ids) landmarks.push_back(&map.At(id));
  return landmarks;
}

std::vector<LandmarkId> LandmarksAround(const Map& map, KeyframeId id, int neighbours, int min_shared) {
  std::vector<KeyframeId> keyframes = map.BestCovisible(id, neighbours, min_shared);
  keyframes.push_back(id);
  return LandmarksSeenBy(map, keyframes);
}

}  // namespace dmslam
