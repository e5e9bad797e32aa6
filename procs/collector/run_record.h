#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "collector/camera_record.h"
#include "collector/correction_record.h"
#include "collector/frame_durations.h"
#include "collector/keyframe_record.h"
#include "collector/memory_growth.h"
#include "dmslam/wire/status.h"

namespace dmslam {

/// All that the summary of a run is made of.
struct RunRecord {
  std::string mode, profile;
  uint64_t seed = 0;
  std::vector<CameraRecord> cameras;  ///< by number; one at least
  bool end_heard = false;             ///< of the first camera's sequence: how many frames it has is known
  MapperStatus mapper;
  LoopcloserStatus loopcloser;
  std::map<std::string, ProcessHealth> health;
  std::map<std::string, MemoryGrowth> memory;  ///< of each process
  FrameDurations durations;                    ///< of the first camera
  KeyframeRecord keyframes;
  std::vector<CorrectionRecord> corrections;
  uint64_t resets = 0;
  int restarts = 0;
  int resumes = 0;                         ///< how often all processes had died
  std::vector<std::string> disk_problems;  ///< why something could not be written while it ran
  std::string end_problem;                 ///< why the end is not what it should have been; empty: it is

  const CameraRecord& first() const { return cameras.front(); }
};

}  // namespace dmslam
