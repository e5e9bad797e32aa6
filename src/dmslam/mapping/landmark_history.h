#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "dmslam/map/landmark_sights.h"
#include "dmslam/map/replica.h"
#include "dmslam/mapping/landmark_fate.h"
#include "dmslam/mapping/mapper_options.h"

namespace dmslam {

/// A change of a map: which, why, and when.
struct MapMoment {
  uint64_t version = 0;  ///< of the map, after it
  MapEvent event = MapEvent::kSnapshot;
  std::optional<KeyframeId> about;  ///< the keyframe that caused it
  /// Capture time of that keyframe, or of the newest frame whose evidence it is; where there is none, of the
  /// newest keyframe that was told before.
  std::optional<int64_t> stamp_ns;
};

/// Which decision made a landmark.
enum class LandmarkOrigin : uint8_t {
  kNotTold = 0,       ///< a snapshot brought it: what was before is not in the records
  kFirstMap = 1,      ///< it is a point of a first map
  kTriangulated = 2,  ///< a keyframe and its neighbours see it (Algorithm 1)
  kOther = 3,         ///< another record brought it
};

/// Another landmark became this one.
struct LandmarkFusion {
  LandmarkId absorbed;
  MapMoment when;
};

/// A keyframe saw a landmark once, and does no more.
struct FormerSight {
  LandmarkSight sight;
  MapMoment until;
  bool keyframe_culled = false;  ///< the keyframe is gone; else it sees something else, or nothing, there
};

/// What frames had said of a landmark by then.
struct EvidenceStep {
  MapMoment when;
  LandmarkEvidence evidence;
};

/// How a landmark left the map.
struct LandmarkEnd {
  MapMoment when;
  LandmarkFate fate = LandmarkFate::kNotTold;
  std::optional<LandmarkId> into;  ///< of one that was fused
  std::string note;                ///< of the record
  /// As it was told last, with what frames said of it when they took it. None: it came and went within one
  /// record.
  std::optional<LandmarkState> last;
  std::vector<LandmarkSight> seen;  ///< who saw it until then
};

/// The life of a landmark, as the records tell it. What it is now is in the map.
struct LandmarkHistory {
  LandmarkId id;
  LandmarkOrigin origin = LandmarkOrigin::kNotTold;
  MapMoment made;
  std::vector<LandmarkSight> made_from;  ///< who saw it in the record that brought it; none of a snapshot
  std::optional<WidestAngle> widest;     ///< of these, with the keyframe that made it
  std::vector<LandmarkFusion> absorbed;  ///< by time
  std::vector<FormerSight> former;       ///< by time
  std::vector<EvidenceStep> evidence;  ///< of one that is watched all of it, else where belief changed sides
  std::optional<LandmarkEnd> end;      ///< none: it is in the map
};

/// Goes through a map's changes and notes which of them made each landmark what it is. `options` are to be
/// those of the run.
class LandmarkHistories {
 public:
  LandmarkHistories(const Camera& camera, const Pyramid& pyramid, const MapperOptions& options)
      : fates_(options), map_(camera, pyramid) {}

  /// Notes all of its evidence, from now on.
  void Watch(LandmarkId id) { watched_.insert(id); }
  /// Another mapper continues the map.
  void OnNewWriter() { fates_.OnNewWriter(); }
  /// What is told now begins with the whole map, in a snapshot or from nothing.
  void BeginAnew();
  /// `said`: of EVIDENCE what the frames said, where that is known.
  void Add(const MapDelta& delta, const FrameEvidence* said = nullptr);
  /// No change follows. What was named and never told is not in the map.
  void Finish();

  const Replica& map() const { return map_; }
  const std::map<LandmarkId, LandmarkHistory>& landmarks() const { return landmarks_; }

 private:
  using Sights = std::map<LandmarkId, std::vector<LandmarkSight>>;

  MapMoment MomentOf(const MapDelta& delta, const FrameEvidence* said) const;
  Sights SightsThatMayChange(const MapDelta& delta) const;
  void EndThoseThatGo(const MapDelta& delta, const MapMoment& now, const FrameEvidence* said);
  void End(LandmarkId id, const MapMoment& now, LandmarkFate fate, const std::string& note);
  bool IsKnownToBeGone(LandmarkId id) const;
  void NoteLastEvidence(LandmarkHistory* history, const FrameEvidence& said) const;
  LandmarkHistory& HistoryOf(LandmarkId id, const MapMoment& now);
  void NoteMade(LandmarkId id, const MapMoment& now);
  void NoteEvidence(LandmarkId id, const MapMoment& now);
  void NoteLostSights(const Sights& before, const MapMoment& now);

  LandmarkFates fates_;
  Replica map_;
  std::optional<int64_t> newest_ns_;
  std::set<LandmarkId> watched_;
  std::map<LandmarkId, LandmarkHistory> landmarks_;
};

}  // namespace dmslam
