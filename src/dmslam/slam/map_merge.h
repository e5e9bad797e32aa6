#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "dmslam/loops/loop_options.h"
#include "dmslam/map/map_editor.h"
#include "dmslam/map/renumbering.h"
#include "dmslam/mapping/landmark_fusion.h"
#include "dmslam/mapping/mapper_options.h"
#include "dmslam/place_recognition/vocabulary.h"

namespace dmslam {

struct MapMergeOptions {
  MapperOptions mapper;
  LoopcloserOptions loop;
  uint64_t seed = 1;
};

struct MapMergeReport {
  /// Two keyframes by which maps became one.
  struct Weld {
    struct End {
      uint32_t frame_index = 0;
      bool of_b = false;  ///< the keyframe is of `b`, not of `a`
    };
    End keyframe, place;  ///< which saw the other one's place
    std::string note;     ///< what it rests on
  };
  bool joined = false;  ///< a map of `a` and one of `b` are one now
  std::vector<Weld> welds;
  size_t keyframes_asked = 0;  ///< whether they show a place of another map
  size_t places_tried = 0;     ///< that looked alike
  size_t places_proposed = 0;  ///< of them, borne out by geometry, but not well enough or by no neighbour
  FusionCounts fused;          ///< beside what the welds fused
};

/// Two maps of one place become one. The steps are those by which a run welds two of its own maps: every
/// keyframe of one is looked for in the other as if it had just come (`LoopcloserCore`, with all that it asks
/// before it believes: docs/loops.md), first those of `b`, then those of `a`; what is found carries one map
/// over to the other (`ApplyCorrection`); then landmarks are fused wherever keyframes of both look at the
/// same, and the whole is adjusted. One thing differs: loops within a map are left to the run that made it.
/// Keyframes of two sessions never count as taken at the same time, so a person who stands in both maps is no
/// proof.
///
/// Where it ends the joined map lies where `a` lay: the first keyframe of its largest map has the pose and
/// the scale that it had.
class MapMerge {
 public:
  /// `names_of_b`: see NamesBeside.
  MapMerge(const Map& a, const Map& b, const Renumbering& names_of_b, const MapMergeOptions& options);

  /// `vocabulary` must be there: without one no place is recognised. `progress` hears, now and then, what is
  /// done, and of how much.
  using Progress = std::function<void(const std::string& what, size_t done, size_t of)>;
  MapMergeReport Run(std::shared_ptr<const Vocabulary> vocabulary, const Progress& progress = {});

  /// All maps of both; those that were joined are one.
  const Map& map() const { return map_; }

 private:
  void Weld(std::shared_ptr<const Vocabulary> vocabulary, const Progress& progress);
  MapMergeReport::Weld::End EndOf(KeyframeId id) const;
  void FuseAll(MapId map_id, const Progress& progress);
  void PutBack();

  /// A keyframe of `a` as it stood.
  struct Anchor {
    KeyframeId id;
    Rigid3d T_cam_world;
    double scale = 1.0;
  };

  MapMergeOptions options_;
  MapEditor map_;
  std::vector<KeyframeId> of_a_, of_b_;
  Anchor anchor_;
  MapMergeReport report_;
};

}  // namespace dmslam
