#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "dmslam/map/feature_store.h"
#include "dmslam/recording/map_file.h"

namespace dmslam {

/// The map of a file, to begin with: whether it goes with what is in use, and how what comes is numbered.
class SavedMap {
 public:
  struct Beginning {
    Map map;
    uint16_t ordinal = 0;  ///< under which new landmarks are numbered
  };

  /// Throws InputError where the file holds no map.
  SavedMap(std::string path, std::shared_ptr<FeatureStore> feature_store);

  /// Hands the map out, once. Throws InputError where it cannot be continued with this camera and pyramid,
  /// or where ids of the session could be in it already.
  Beginning Begin(const Camera& camera, const Pyramid& pyramid, uint32_t session);
  /// Why the vocabulary of that checksum is not the one with which it was made; empty: it is, or one of the
  /// two has none.
  std::string WhyMisfits(std::optional<uint64_t> vocabulary_checksum) const;
  /// Of which it was made, as far as the file says.
  const SessionRuns& runs() const { return runs_; }

 private:
  const std::string path_;
  std::optional<RebuiltMap> map_;  ///< none: handed out
  const SessionStart made_;        ///< how it was made
  const SessionRuns runs_;
};

}  // namespace dmslam
