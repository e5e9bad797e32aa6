#pragma once

#include <cstdint>
#include <functional>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "dmslam/map/replica.h"
#include "dmslam/recording/log_index.h"
#include "dmslam/wire/frontend_messages.h"

namespace dmslam {

/// With which seed and settings sessions were played, by session: of those of which it is known.
using SessionRuns = std::map<uint32_t, SessionStart>;

/// A map with what it rests on.
struct RebuiltMap {
  Replica map;
  SessionStart session;  ///< camera, pyramid, vocabulary ... of the run that made it
  SessionRuns runs{};    ///< of which it is made, as far as the file says
  int64_t records = 0;   ///< that were applied
  int64_t missing = 0;   ///< records of the map that the log lacks: the map is as good as it can be
  uint64_t skipped = 0;  ///< what records said of keyframes and landmarks that are not there, because of that
  bool ended = false;    ///< the mapper had done all it wanted to do
};

/// What the frontend said of itself when it began, or where that was not recorded what the player said of its
/// camera.
std::optional<SessionStart> FindSessionStart(const LogIndex& log, const RecordedSession& session);

/// How the map of a session was made, found without building it. Throws InputError when the log holds no map
/// of the session, and for a saved map of which anything is missing, damaged, or of another version.
SessionStart MadeWith(const LogIndex& log, const RecordedSession& session);
SessionStart MadeWith(const std::string& path);

/// What a file says of the runs of which the `map` in it is made. A log knows its own run; a saved map that
/// of its one session, or those that it lists. `made`: see MadeWith.
SessionRuns RunsOf(const RecordedSession& session, const SessionStart& made, const Map& map);

/// Who goes through the recorded changes of a map. What is empty is not called.
struct ChangeReader {
  std::function<void()> begins_anew;            ///< what was told before is void
  std::function<void()> new_writer;             ///< what follows was written by another mapper than so far
  std::function<void(const MapDelta&)> change;  ///< a whole one, however many records it took
};
struct ChangesRead {
  int64_t records = 0;  ///< that could be read
  int64_t missing = 0;  ///< that the log lacks, or that cannot be applied
};

/// Hands out the changes of a session's map in order, up to `until_us` of wall time. Throws InputError where
/// there are none, and for a saved map of which any cannot be read.
ChangesRead ForEachChange(const LogIndex& log, const RecordedSession& session, int64_t until_us,
                          const ChangeReader& reader);

/// Builds the map of a session from its recorded map records, up to `until_us` of wall time. With all records
/// in the log it is the mapper's own map at that time. Throws InputError as MadeWith does. `features`:
/// where the map keeps them; null: in memory.
RebuiltMap RebuildMap(const LogIndex& log, const RecordedSession& session, int64_t until_us = INT64_MAX,
                      std::shared_ptr<FeatureStore> features = nullptr);

/// A map as it will be written: taken from a map at one time, whoever writes it when and where.
struct CutMap {
  std::vector<MapDelta> pieces;
  std::set<uint32_t> sessions;  ///< whose keyframes are in it
  int64_t stamp_ns = 0;         ///< of the newest keyframe
};
/// Throws InputError for an empty map.
CutMap Cut(const std::string& path, const Map& map);

/// Writes a map as a log: a beacon, which says the version to every later one, its session, then the whole
/// map as records. The same map gives the same bytes. `runs`: what is known of the runs of which it is made;
/// where they are not given, `session` is that of a run, and all that is known. Throws InputError when that
/// cannot be written.
void SaveMap(const std::string& path, const Map& map, const SessionStart& session);
void SaveMap(const std::string& path, const Map& map, const SessionStart& session, const SessionRuns& runs);
void SaveMap(const std::string& path, const CutMap& map, const SessionStart& session,
             const SessionRuns& runs);

/// Reads what SaveMap has written, or rebuilds the map of any other log of a run. `key`: as for LogIndex.
/// Throws InputError.
RebuiltMap LoadMap(const std::string& path, const std::optional<BusKey>& key = std::nullopt,
                   std::shared_ptr<FeatureStore> features = nullptr);

/// Throws InputError unless a map that was `made` so can be continued with this camera and pyramid.
void CheckFits(const std::string& path, const SessionStart& made, const Camera& camera,
               const Pyramid& pyramid);
/// Throws InputError where ids of the session could be in `map` already.
void CheckSessionIsNew(const std::string& path, const Map& map, uint32_t session);
/// Why a map that was `made` so does not go with the vocabulary of that checksum; empty: it does, or one of
/// the two has none.
std::string WhyOtherVocabulary(const std::string& path, const SessionStart& made,
                               std::optional<uint64_t> checksum);

/// Throws MisfitError that says so.
void CheckVocabulary(const std::string& path, const SessionStart& made, std::optional<uint64_t> checksum);

/// The highest session and the highest epoch's ordinal that the map's ids name: new ids must lie above.
uint32_t NewestSession(const Map& map);
uint16_t NewestOrdinal(const Map& map);
/// The map that holds most keyframes; none: there is no keyframe.
std::optional<MapId> LargestMap(const Map& map);

}  // namespace dmslam
