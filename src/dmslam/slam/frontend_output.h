#pragma once

#include <cstdint>
#include <iterator>
#include <utility>
#include <variant>
#include <vector>

#include "dmslam/map/proposals.h"

namespace dmslam {

/// A record of the frontend's stream.
using FrontendEvent = std::variant<FramePose, InitialMap, KeyframeProposal, FrameEvidence, MapReset>;

/// What the frontend has to say, in order. Of a frame: its pose is the last FramePose.
struct FrontendOutput {
  std::vector<FrontendEvent> events;

  void Add(FrontendEvent event) { events.push_back(std::move(event)); }
  void Append(FrontendOutput more) {
    events.insert(events.end(), std::make_move_iterator(more.events.begin()),
                  std::make_move_iterator(more.events.end()));
  }
};

struct FrontendCounters {
  uint64_t frames = 0;
  uint64_t tracked = 0;
  uint64_t relocalizations = 0;
  uint64_t resets = 0;
  uint64_t keyframes_proposed = 0;
  uint64_t keyframes_withheld = 0;  ///< wanted, but the mapper is behind
};

}  // namespace dmslam
