#pragma once

#include <cstdint>
#include <memory_resource>
#include <span>
#include <unordered_map>

#include "dmslam/dynamics/proven.h"
#include "dmslam/map/map.h"

namespace dmslam {

struct VoteOptions {
  bool motion_belief = true;  ///< landmarks that are believed to move have no vote; off: all are equal
  double young_trust = 0.3;   ///< weight of a landmark that was just made...
  double trusted_age_s = kPeopleStandS;  ///< ...which grows to one when it stood still for so long

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Switch("tracking.motion_belief", motion_belief,
             "landmarks that are believed to move have no vote; switching it off also switches off elders, "
             "rival motions, hidden places, trust by age and the belief that the mapper keeps");
    v.InBaseline("off");
    v.InPaper("off");
    v.Number("tracking.young_trust", young_trust, 0, 1, "", "weight of a landmark that was just made");
    v.Number("tracking.trusted_age_s", trusted_age_s, 0, 1000, "s",
             "age at which a landmark has full weight");
  }
};

/// For how long landmarks stand in their places at a moment [s]: since they were made, or, where time runs
/// backwards and in a map of another time, until they were seen last.
class LandmarkAges {
 public:
  /// The map stays as it is meanwhile.
  LandmarkAges(const Map& map, int64_t stamp_ns) : map_(map), stamp_ns_(stamp_ns) {}
  double Of(const Landmark& landmark);

 private:
  const Map& map_;
  int64_t stamp_ns_;
  // The keyframe that was asked for last: neighbours were seen last by the same.
  KeyframeId last_;
  const Keyframe* last_keyframe_ = nullptr;
};

/// Whether the landmark was made so long before that moment that it has full weight. Not LandmarkAges, which
/// look both ways: where time runs backwards none is old here, for the map begins where the room was hidden
/// before, so that landmarks which are not seen there are no sign of a wrong pose.
bool IsOldAt(const Landmark& landmark, int64_t stamp_ns, const VoteOptions& options);

/// Which landmarks have a say in a frame's pose, and how much: what the map believes of them, their age, and
/// a short memory of those that were just seen elsewhere.
class LandmarkVotes {
 public:
  explicit LandmarkVotes(const VoteOptions& options) : options_(options) {}

  /// Whether the landmark may be matched at all.
  bool HasVote(const Landmark& landmark) const;
  /// Weight in a pose of a landmark of this age: young_trust to 1.
  double Trust(double age_s) const;

  void OnSeenElsewhere(LandmarkId id) { ++streaks_[id]; }
  void OnFound(LandmarkId id) { streaks_.erase(id); }
  void TakeBackSeenElsewhere(LandmarkId id);
  void Reset() { streaks_.clear(); }

  const VoteOptions& options() const { return options_; }

 private:
  /// So many sightings elsewhere in a row cost the vote, before the mapper says so.
  static constexpr int kStreakWithoutVote = 3;
  VoteOptions options_;
  std::pmr::unsynchronized_pool_resource pool_;
  std::pmr::unordered_map<LandmarkId, int> streaks_{&pool_};  ///< sightings elsewhere in a row
};

}  // namespace dmslam
