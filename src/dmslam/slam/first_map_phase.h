#pragma once

#include <functional>
#include <optional>
#include <string>

#include "dmslam/initialization/initializer.h"
#include "dmslam/map/proposals.h"
#include "dmslam/map/tracked_frame.h"
#include "dmslam/slam/first_map_method.h"

namespace dmslam {

/// Takes a frame of the stream in which a first map is looked for, and says what is known by now.
using FirstMapSearch = std::function<InitializerReport(const InitializerFrame&)>;

/// The search by `method`. Those of two frames alone know nothing of `options`. `pyramid` is that of the
/// features, as it is set.
FirstMapSearch MakeFirstMapSearch(FirstMapMethod method, const InitializerOptions& options,
                                  const Camera& camera, const Pyramid& pyramid, uint64_t seed);

/// Looks for a first map in the frames of a stream; begins anew when a map was given up.
class FirstMapPhase {
 public:
  explicit FirstMapPhase(std::function<FirstMapSearch()> make_search)
      : make_search_(std::move(make_search)), search_(make_search_()) {}

  struct Answer {
    std::optional<InitialMap> proposal;
    std::string reason;  ///< why there is none; for people
  };
  Answer AddFrame(const TrackedFrame& frame, uint32_t session, CameraId camera_id, MapId map_id);
  void Restart() { search_ = make_search_(); }

 private:
  std::function<FirstMapSearch()> make_search_;
  FirstMapSearch search_;
};

}  // namespace dmslam
