#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/map/landmark_sights.h"
#include "dmslam/map/map_delta.h"
#include "dmslam/mapping/landmark_history.h"
#include "dmslam/messaging/bus_key.h"
#include "dmslam/recording/map_file.h"

namespace dmslam {

/// What is to be read, and how.
struct ProofSource {
  std::string path;      ///< log of a run, or a saved map
  uint32_t session = 0;  ///< of the log; 0: the only one
  double at_s = -1;      ///< seconds after the log's beginning; negative: all of it
  std::string config;    ///< the run's settings (YAML); empty: none
  std::vector<std::string> overrides;
};

/// What a file proves of its landmarks.
struct LandmarkProofs {
  std::string path;
  bool of_log = false;    ///< else a saved map: what is in it, and no history
  SessionStart run;       ///< seed, configuration ... of the run that made it, or that saved it
  bool run_told = false;  ///< false: the log lacks what the frontend said of the run
  /// The mapper's rules were asked with the settings of the run, which has its profile's, and these.
  bool settings_known = false;
  std::string modes;
  ChangesRead read;
  LandmarkHistories histories;

  const Map& map() const { return histories.map(); }
};

/// Reads the file; of `watched` all evidence is kept. Throws InputError.
LandmarkProofs ReadProofs(const ProofSource& source, std::optional<LandmarkId> watched,
                          const std::optional<BusKey>& key);

/// What a landmark is now, or was when it was told last.
struct LandmarkNow {
  bool in_map = false;
  std::optional<LandmarkState> state;  ///< none: it was never told
  std::vector<LandmarkSight> seen;
};
LandmarkNow NowOf(const LandmarkProofs& proofs, const LandmarkHistory& history);

/// "1:217": ordinal of the mapper's epoch, and number; or both as the one number that messages carry. None
/// where it is neither.
std::optional<LandmarkId> ParseLandmarkId(const std::string& text);
std::string NameOf(LandmarkId id);

// The names of things in what machines read: those of the message types, where there are some.

std::string NameOf(MapEvent event);
std::string NameOf(LandmarkOrigin origin);
std::string NameOf(LandmarkFate fate);

}  // namespace dmslam
