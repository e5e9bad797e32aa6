#pragma once

#include <string>
#include <vector>

#include "dmslam/messaging/types.h"
#include "dmslam/util/ids.h"

namespace dmslam {

/// A stream of records: who writes it, what it carries, who reads it. Where there are several cameras, the
/// frontend stands for that of each.
struct StreamPlan {
  std::string writer;                 ///< role
  std::vector<std::string> records;   ///< channels
  std::vector<std::string> readers;   ///< roles that are to have all of it: the writer waits for them
  std::vector<std::string> watchers;  ///< roles that read it too, and for which nobody waits
};

/// Of kFrontend, kMap and kLoopCloser.
const StreamPlan& PlanOf(StreamId stream);

/// The roles that are to have all of a stream, with the frontend of each camera.
std::vector<std::string> ReadersOf(StreamId stream, CameraId num_cameras);

}  // namespace dmslam
