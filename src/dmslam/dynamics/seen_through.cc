#include "dmslam/dynamics/seen_through.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <span>
#include <unordered_map>
#include <vector>

#include "dmslam/camera/image_scale.h"
#include "dmslam/dynamics/proven.h"
#include "dmslam/geometry/point_grid.h"

namespace dmslam {
namespace {

constexpr int kCoarsestOctave = std::numeric_limits<int>::max();

// Who sees through a suspect.
constexpr double kGuardS = 0.5;             // witnesses are at least so far in time from when it was seen
constexpr double kAroundRad = 0.0533;       // around its pixel a witness's landmarks are compared
constexpr double kDepthTolerance = 0.11;    // relative difference of depth that is still the same place
constexpr double kThroughPerSupport = 0.2;  // who sees through it, per witness that sees something there
constexpr size_t kMaxWitnesses = 60;        // while mapping
constexpr double kWitnessAngleRad = 1.0;    // between the viewing directions of keyframe and witness
// Who shares its fate.
constexpr double kTogetherRad = 0.133;  // neighbours within this...
constexpr double kTogetherShare = 0.3;  // ...when so many of them are condemned
constexpr int kRounds = 4;              // of both tests
// Where so many of the unproven are seen through somebody must have stood. Then unproven ones go beside
// which, at other times, no more keyframes see a proven one of the same depth than this, times their own
// observers; and so many times their neighbours.
constexpr double kStoodShare = 0.5;
constexpr double kSupportPerObservation = 1.0;
constexpr double kSupportTolerance = 0.05;  // of depth: people stand before furniture, not in it
constexpr int kRoundsUnsupported = 2;

// Suspects and witnesses are found once and named by reference. What is still looked up is what the map's own
// records name by id: what a feature sees (`LandmarkSeenBy`), and who observes a landmark (`At`). Nothing is
// removed before all is decided, so every reference holds until then.

struct Suspect {
  const Landmark* landmark = nullptr;
  int64_t first_ns = 0, last_ns = 0;  ///< seen from then to then
  int through = 0;                    ///< keyframes of another time that see through it
  int support = 0;                    ///< that see something at its place
  int proven_support = 0;             ///< that see something proven there
  bool condemned = false;
};

/// Who looks at suspects, and how far. All that it sees is nearer, so of what lies beyond it says nothing.
struct WitnessView {
  const Keyframe* keyframe = nullptr;
  double reach = 0;  ///< along the optical axis
};

WitnessView WitnessOf(const Map& map, const Keyframe& keyframe) {
  double farthest = 0;
  for (size_t feature = 0; feature < keyframe.landmarks.size(); ++feature) {
    const Landmark* landmark = map.LandmarkSeenBy(keyframe, feature);
    if (landmark != nullptr) farthest = std::max(farthest, (keyframe.T_cam_world * landmark->p_world).z());
  }
  return {&keyframe, farthest / (1 - kDepthTolerance)};
}

/// The box around all that a witness sees: its pyramid has five corners.
Eigen::AlignedBox3d ViewOf(const Camera& camera, const WitnessView& witness) {
  const Rigid3d T_world_cam = witness.keyframe->T_cam_world.Inverse();
  Eigen::AlignedBox3d box(T_world_cam.translation);
  for (const int x_px : {0, camera.width_px}) {
    for (const int y_px : {0, camera.height_px})
      box.extend(T_world_cam * (witness.reach * camera.Ray({x_px, y_px})));
  }
  return box;
}

/// The edge of the cubes that suspects are kept in: a quarter of how far witnesses see.
double EdgeOf(std::span<const WitnessView> witnesses) {
  std::vector<double> reaches;
  for (const WitnessView& witness : witnesses) reaches.push_back(witness.reach);
  if (reaches.empty()) return 1.0;
  const auto middle = reaches.begin() + static_cast<ptrdiff_t>(reaches.size() / 2);
  std::nth_element(reaches.begin(), middle, reaches.end());
  return *middle > 0 ? *middle / 4 : 1.0;
}

/// Those of some landmarks that are not proven, by id and by place.
class Suspects {
 public:
  Suspects(const Map& map, const std::vector<const Landmark*>& landmarks, double edge) : places_(edge) {
    for (const Landmark* landmark : landmarks) {
      const std::vector<int64_t> stamps = ObservationStamps(map, *landmark);
      if (stamps.empty() || OutlastsStanding(stamps, ProvenOptions())) continue;
      suspects_.push_back({landmark, stamps.front(), stamps.back()});
    }
    std::ranges::sort(suspects_, {}, [](const Suspect& suspect) { return suspect.landmark->id; });
    for (uint32_t i = 0; i < suspects_.size(); ++i) {
      index_.emplace(suspects_[i].landmark->id, i);
      places_.Add(suspects_[i].landmark->p_world, i);
    }
  }

  /// Null: not one of them.
  const Suspect* Find(LandmarkId id) const {
    const auto found = index_.find(id);
    return found == index_.end() ? nullptr : &suspects_[found->second];
  }
  /// Calls `visit` for each suspect in the box, and for some around it.
  template <typename Visit>
  void ForEachIn(const Eigen::AlignedBox3d& box, const Visit& visit) {
    places_.ForEachIn(box, [&](uint32_t i) { visit(suspects_[i]); });
  }
  size_t size() const { return suspects_.size(); }
  auto begin() { return suspects_.begin(); }
  auto end() { return suspects_.end(); }
  auto begin() const { return suspects_.begin(); }
  auto end() const { return suspects_.end(); }

 private:
  std::vector<Suspect> suspects_;
  std::unordered_map<LandmarkId, uint32_t> index_;
  PointGrid places_;
};

double Seconds(int64_t ns) { return static_cast<double>(ns) * 1e-9; }

bool InImage(const Camera& camera, const Eigen::Vector2d& uv_px) {
  return uv_px.x() >= 0 && uv_px.y() >= 0 && uv_px.x() < camera.width_px && uv_px.y() < camera.height_px;
}

struct Depths {
  int behind = 0;
  int same = 0;
  int proven_same = 0;  ///< within the narrower tolerance
};

/// Depths of the landmarks that `witness` sees around the pixel of `p_world`, relative to its own.
Depths LookThrough(const Map& map, const WitnessView& at, const Eigen::Vector3d& p_world,
                   const Suspects& suspects) {
  Depths depths;
  const Keyframe& witness = *at.keyframe;
  const Eigen::Vector3d p_cam = witness.T_cam_world * p_world;
  if (p_cam.z() > at.reach) return depths;
  const auto uv_px = map.camera().Project(p_cam);
  if (!uv_px || !InImage(map.camera(), *uv_px)) return depths;
  witness.features->grid.ForEachInRadius(
      *uv_px, SearchRadiusPx(map.camera(), kAroundRad), 0, kCoarsestOctave, [&](uint32_t feature) {
        const Landmark* other = map.LandmarkSeenBy(witness, feature);
        if (other == nullptr) return;
        const Suspect* suspect = suspects.Find(other->id);
        if (suspect != nullptr && suspect->condemned) return;
        const double ratio = (witness.T_cam_world * other->p_world).z() / p_cam.z();
        if (ratio > 1 + kDepthTolerance) {
          ++depths.behind;
        } else if (ratio > 1 - kDepthTolerance) {
          ++depths.same;
          if (suspect == nullptr && std::abs(ratio - 1) < kSupportTolerance) ++depths.proven_same;
        }
      });
  return depths;
}

/// Returns how many.
int Condemn(const std::vector<Suspect*>& found) {
  for (Suspect* suspect : found) suspect->condemned = true;
  return static_cast<int>(found.size());
}

/// Whether the witness is from about when the suspect was seen.
bool IsOfItsTime(const Keyframe& witness, const Suspect& suspect) {
  return Seconds(suspect.first_ns - witness.stamp_ns) < kGuardS &&
         Seconds(witness.stamp_ns - suspect.last_ns) < kGuardS;
}

/// Asks every witness from another time, and condemns the suspects that are seen through. Returns how many.
int CondemnSeenThrough(const Map& map, std::span<const WitnessView> witnesses, Suspects* suspects) {
  for (Suspect& suspect : *suspects) suspect.through = suspect.support = suspect.proven_support = 0;
  for (const WitnessView& witness : witnesses) {
    suspects->ForEachIn(ViewOf(map.camera(), witness), [&](Suspect& suspect) {
      if (suspect.condemned || IsOfItsTime(*witness.keyframe, suspect)) return;
      const Depths depths = LookThrough(map, witness, suspect.landmark->p_world, *suspects);
      if (depths.behind > 0 && depths.same == 0) ++suspect.through;
      if (depths.same > 0) ++suspect.support;
      if (depths.proven_same > 0) ++suspect.proven_support;
    });
  }
  std::vector<Suspect*> found;
  for (Suspect& suspect : *suspects) {
    if (suspect.through > kThroughPerSupport * suspect.support) found.push_back(&suspect);
  }
  return Condemn(found);
}

/// Share of a landmark's neighbours, in the keyframes that see it and at its depth, that are condemned.
double CondemnedAround(const Map& map, const Landmark& landmark, const Suspects& suspects) {
  const double together_px = SearchRadiusPx(map.camera(), kTogetherRad);
  int all = 0, condemned = 0;
  for (const Observation& o : landmark.observations) {
    const Keyframe& keyframe = map.At(o.keyframe);
    const double depth = (keyframe.T_cam_world * landmark.p_world).z();
    const auto visit = [&](uint32_t feature) {
      const Landmark* other = map.LandmarkSeenBy(keyframe, feature);
      if (other == nullptr || other == &landmark) return;
      const double ratio = (keyframe.T_cam_world * other->p_world).z() / depth;
      if (std::abs(ratio - 1) > kDepthTolerance) return;
      ++all;
      const Suspect* suspect = suspects.Find(other->id);
      if (suspect != nullptr && suspect->condemned) ++condemned;
    };
    keyframe.features->grid.ForEachInRadius(keyframe.features->uv_px[o.feature], together_px, 0,
                                            kCoarsestOctave, visit);
  }
  return all > 0 ? static_cast<double>(condemned) / all : 0.0;
}

/// Where the condemned are seen. Most suspects are near none of them, and need no closer look.
class CondemnedPlaces {
 public:
  CondemnedPlaces(const Map& map, const Suspects& suspects) : map_(map) {
    for (const Suspect& suspect : suspects) {
      if (!suspect.condemned) continue;
      for (const Observation& o : suspect.landmark->observations) uv_px_[o.keyframe].push_back(PixelOf(o));
    }
  }

  bool AnyNear(const Landmark& landmark, double radius_px) const {
    return std::any_of(landmark.observations.begin(), landmark.observations.end(), [&](const Observation& o) {
      const auto there = uv_px_.find(o.keyframe);
      if (there == uv_px_.end()) return false;
      const Eigen::Vector2d uv_px = PixelOf(o);
      return std::any_of(there->second.begin(), there->second.end(), [&](const Eigen::Vector2d& other) {
        return (other - uv_px).squaredNorm() <= radius_px * radius_px;
      });
    });
  }

 private:
  const Eigen::Vector2d& PixelOf(const Observation& o) const {
    return map_.At(o.keyframe).features->uv_px[o.feature];
  }

  const Map& map_;
  std::map<KeyframeId, std::vector<Eigen::Vector2d>> uv_px_;
};

/// Suspects among the condemned share their fate. Returns how many.
int CondemnTogether(const Map& map, Suspects* suspects) {
  std::vector<Suspect*> found;
  const CondemnedPlaces condemned(map, *suspects);
  const double together_px = SearchRadiusPx(map.camera(), kTogetherRad);
  for (Suspect& suspect : *suspects) {
    if (suspect.condemned) continue;
    const bool near = condemned.AnyNear(*suspect.landmark, together_px + 1e-6);
    const double share = near ? CondemnedAround(map, *suspect.landmark, *suspects) : 0.0;
    if (share >= kTogetherShare) found.push_back(&suspect);
  }
  return Condemn(found);
}

/// Where somebody stood, an unproven landmark needs proven ones at its place, seen at other times by more
/// keyframes than see the landmark itself: whoever stood there was seen often, and what stands at his depth
/// by chance seldom. Its neighbours share its fate.
void CondemnUnsupported(const Map& map, Suspects* suspects) {
  for (Suspect& suspect : *suspects) {
    const auto observers = static_cast<double>(suspect.landmark->observations.size());
    const bool supported = suspect.proven_support > kSupportPerObservation * observers;
    if (!supported) suspect.condemned = true;
  }
  for (int round = 0; round < kRoundsUnsupported; ++round) CondemnTogether(map, suspects);
}

int RemoveCondemned(MapEditor& map, const Suspects& suspects) {
  int removed = 0;
  for (const Suspect& suspect : suspects) {
    if (!suspect.condemned) continue;
    map.RemoveLandmark(*suspect.landmark);
    ++removed;
  }
  return removed;
}

/// Both tests by turns, as long as one of them finds more; `condemned`: so many are already.
void CondemnInRounds(const Map& map, std::span<const WitnessView> witnesses, int condemned,
                     Suspects* suspects) {
  if (condemned == 0) return;
  for (int round = 0; round < kRounds; ++round) {
    condemned += CondemnTogether(map, suspects);
    if (condemned == 0) return;
    condemned = CondemnSeenThrough(map, witnesses, suspects);
  }
}

/// Keyframes that look where this one looks, nearest first.
std::vector<WitnessView> WitnessesNear(const Map& map, const Keyframe& keyframe) {
  const double depth = map.MedianDepth(keyframe).value_or(0.0);
  std::vector<WitnessView> witnesses;
  for (const Keyframe* near : map.KeyframesNear(keyframe, depth, kWitnessAngleRad)) {
    if (witnesses.size() < kMaxWitnesses) witnesses.push_back(WitnessOf(map, *near));
  }
  return witnesses;
}

}  // namespace

int RemoveSeenThrough(MapEditor& map, const Keyframe& keyframe) {
  std::vector<const Landmark*> landmarks;
  for (size_t feature = 0; feature < keyframe.landmarks.size(); ++feature) {
    const Landmark* landmark = map.LandmarkSeenBy(keyframe, feature);
    if (landmark != nullptr) landmarks.push_back(landmark);
  }
  const std::vector<WitnessView> witnesses = WitnessesNear(map, keyframe);
  Suspects suspects(map, landmarks, EdgeOf(witnesses));
  CondemnInRounds(map, witnesses, CondemnSeenThrough(map, witnesses, &suspects), &suspects);
  return RemoveCondemned(map, suspects);
}

int RemoveUnproven(MapEditor& map, MapId map_id, uint64_t removed_before) {
  const std::vector<const Landmark*> landmarks = map.LandmarksOf(map_id);
  std::vector<WitnessView> witnesses;
  for (const Keyframe* keyframe : map.KeyframesOf(map_id)) witnesses.push_back(WitnessOf(map, *keyframe));
  Suspects suspects(map, landmarks, EdgeOf(witnesses));
  const int seen_through = CondemnSeenThrough(map, witnesses, &suspects);
  const double before = static_cast<double>(removed_before);
  const bool can_be_proven = suspects.size() < landmarks.size() && CanBeProven(map, map_id, ProvenOptions());
  const bool somebody_stood =
      can_be_proven && before + seen_through > kStoodShare * (before + static_cast<double>(suspects.size()));
  int condemned = seen_through;
  for (Suspect& suspect : suspects) {
    if (!somebody_stood || suspect.condemned || suspect.landmark->evidence.moved <= 0) continue;
    suspect.condemned = true;
    ++condemned;
  }
  CondemnInRounds(map, witnesses, condemned, &suspects);
  if (somebody_stood) CondemnUnsupported(map, &suspects);
  return RemoveCondemned(map, suspects);
}

}  // namespace dmslam
