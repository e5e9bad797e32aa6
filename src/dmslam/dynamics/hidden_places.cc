#include "dmslam/dynamics/hidden_places.h"

#include "dmslam/dynamics/found_share.h"

namespace dmslam {

void HiddenPlaces::DropMatches(const Map& map, std::span<const ExpectedLandmark> expected,
                               const LandmarkVotes& votes, TrackedFrame* frame) {
  ListMatched(*frame, &matched_);
  FoundShare share(map.camera());
  for (const auto& [landmark, view] : expected) {
    if (!votes.HasVote(*landmark)) continue;
    share.Add(view.uv_px, matched_.Holds(landmark->id));
  }
  for (size_t i = 0; i < frame->landmarks.size(); ++i) {
    const Landmark* landmark = frame->landmarks[i].valid() ? map.FindLandmark(frame->landmarks[i]) : nullptr;
    if (landmark == nullptr) continue;
    const double allowed =
        options_.distance + options_.distance_slope * share.Around(frame->features->uv_px[i]);
    if (HammingDistance(landmark->descriptor, frame->features->set.descriptors[i]) > allowed) {
      frame->landmarks[i] = LandmarkId{};
    }
  }
}

}  // namespace dmslam
