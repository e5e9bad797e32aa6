#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
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

/// A run of which landmarks come: with which seed, configuration ... it was played.
struct ProvenRun {
  SessionStart start;
  /// Its settings are its profile's, with `modes`, and those that are given.
  bool settings_known = false;
  std::string modes;
};

/// What a file proves of its landmarks.
struct LandmarkProofs {
  std::string path;
  bool of_log = false;                               ///< else a saved map: what is in it, and no history
  uint32_t session = 0;                              ///< of the log
  std::map<uint32_t, ProvenRun> runs;                ///< by session, as far as the file tells them
  std::map<uint16_t, uint32_t> sessions_by_ordinal;  ///< in which sessions landmarks were numbered so
  ChangesRead read;
  LandmarkHistories histories;

  const Map& map() const { return histories.map(); }
  /// What is known of the run of that session; null: nothing.
  const ProvenRun* RunOf(uint32_t session_of_run) const;
  /// The sessions of the runs that the file tells, or whose keyframes are in it.
  std::set<uint32_t> Sessions() const;
  /// The session in which a landmark was made; none: the file does not say.
  std::optional<uint32_t> SessionOf(const LandmarkHistory& history) const;
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
