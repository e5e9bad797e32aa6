#include "purity.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <map>
#include <memory>
#include <vector>

#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr int64_t kMaskToleranceNs = 20'000'000;

/// In how many keyframes a landmark was seen, and in how many of these on a person.
struct Sightings {
  size_t all = 0;
  size_t on_people = 0;
};

bool IsOnPerson(const GrayImage& mask, const Keypoint& keypoint) {
  const int x = std::clamp(static_cast<int>(std::lround(keypoint.x_px())), 0, mask.width - 1);
  const int y = std::clamp(static_cast<int>(std::lround(keypoint.y_px())), 0, mask.height - 1);
  return mask.at(x, y) != 0;
}

void AddSightings(const Keyframe& keyframe, const GrayImage& mask,
                  std::map<LandmarkId, Sightings>* sightings) {
  for (size_t feature = 0; feature < keyframe.landmarks.size(); ++feature) {
    if (!keyframe.landmarks[feature].valid()) continue;
    Sightings& landmark = (*sightings)[keyframe.landmarks[feature]];
    ++landmark.all;
    landmark.on_people += IsOnPerson(mask, keyframe.features->set.keypoints[feature]);
  }
}

}  // namespace

double MapPurity::OnPeoplePercent() const {
  return landmarks == 0 ? 0.0 : 100.0 * static_cast<double>(on_people) / static_cast<double>(landmarks);
}

MapPurity JudgeMap(const Map& map, MapId map_id, const MaskOf& mask_of) {
  MapPurity purity;
  std::map<LandmarkId, Sightings> sightings;
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (keyframe.map_id != map_id) continue;
    ++purity.keyframes;
    const std::optional<GrayImage> mask = mask_of(keyframe.stamp_ns);
    if (mask && !mask->empty()) {
      AddSightings(keyframe, *mask, &sightings);
    } else {
      ++purity.keyframes_unjudged;
    }
  }
  for (const auto& [id, landmark] : sightings) {
    ++purity.landmarks;
    purity.on_people += 2 * landmark.on_people > landmark.all;
    purity.ever_on_people += landmark.on_people > 0;
  }
  return purity;
}

MaskOf MasksIn(const std::string& folder) {
  const std::string list = (std::filesystem::path(folder) / "mask.txt").string();
  if (!std::filesystem::exists(list))
    throw InputError(list +
                     ": is not there; name a sequence's folder that has masks (mask.txt and its images)");
  const auto files = std::make_shared<const std::vector<StampedFile>>(ReadStampedFiles(list));
  return [files](int64_t stamp_ns) -> std::optional<GrayImage> {
    const auto file = FindNearest(*files, stamp_ns, kMaskToleranceNs);
    if (!file) return std::nullopt;
    return LoadGray(file->path);
  };
}

std::string PurityJson(const MapPurity& purity) {
  char text[512];
  std::snprintf(
      text, sizeof(text),
      "{\n \"keyframes\": %zu,\n \"keyframes_unjudged\": %zu,\n \"landmarks\": %zu,\n \"on_people\": %zu,\n"
      " \"ever_on_people\": %zu,\n \"on_people_percent\": %.4f\n}\n",
      purity.keyframes, purity.keyframes_unjudged, purity.landmarks, purity.on_people, purity.ever_on_people,
      purity.OnPeoplePercent());
  return text;
}

}  // namespace dmslam
