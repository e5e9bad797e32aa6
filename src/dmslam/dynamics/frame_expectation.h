#pragma once

#include <cstdint>
#include <vector>

#include "dmslam/map/landmark_set.h"
#include "dmslam/map/projection.h"
#include "dmslam/map/tracked_frame.h"

namespace dmslam {

/// A landmark of the map that a frame should see, and where.
struct ExpectedLandmark {
  const Landmark* landmark;
  LandmarkView view;

  LandmarkId id() const { return landmark->id; }
};

/// A match that the frame's pose does not agree with.
struct RejectedMatch {
  LandmarkId landmark;
  uint16_t feature = 0;
  double chi2 = 0;  ///< squared reprojection error over the feature's variance
};

/// The landmarks that a frame's features are matched with.
inline void ListMatched(const TrackedFrame& frame, LandmarkSet* matched) {
  matched->Clear();
  for (const LandmarkId id : frame.landmarks) {
    if (id.valid()) matched->Add(id);
  }
  matched->Finish();
}

/// 1 for each feature of a frame that is matched.
inline void MarkMatched(const TrackedFrame& frame, std::vector<uint8_t>* taken) {
  taken->assign(frame.landmarks.size(), 0);
  for (size_t i = 0; i < frame.landmarks.size(); ++i) (*taken)[i] = frame.landmarks[i].valid() ? 1 : 0;
}

}  // namespace dmslam
