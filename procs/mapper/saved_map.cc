#include "mapper/saved_map.h"

#include <utility>

#include "dmslam/console/log.h"
#include "dmslam/util/check.h"

namespace dmslam {

SavedMap::SavedMap(std::string path, std::shared_ptr<FeatureStore> feature_store)
    : path_(std::move(path)),
      map_(LoadMap(path_, std::nullopt, std::move(feature_store))),
      made_(map_->session),
      runs_(map_->runs) {}

SavedMap::Beginning SavedMap::Begin(const Camera& camera, const Pyramid& pyramid, uint32_t session) {
  CheckFits(path_, made_, camera, pyramid);
  const Map& map = map_->map;
  CheckSessionIsNew(path_, map, session);
  if (map_->missing > 0) {
    LogWarning(
        "{}: {} map records are missing in it, {} references lead nowhere; the map is as good as it can be",
        path_, map_->missing, map_->skipped);
  }
  const auto ordinal = static_cast<uint16_t>(NewestOrdinal(map) + 1);
  LogInfo("{}: {} keyframes and {} landmarks loaded", path_, map.keyframes().size(), map.num_landmarks());
  return {std::exchange(map_, std::nullopt)->map, ordinal};
}

std::string SavedMap::WhyMisfits(std::optional<uint64_t> vocabulary_checksum) const {
  return WhyOtherVocabulary(path_, made_, vocabulary_checksum);
}

}  // namespace dmslam
