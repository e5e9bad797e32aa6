#pragma once

#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "collector/durations.h"
#include "dmslam/slam/trajectory_builder.h"
#include "dmslam/wire/frontend_messages.h"
#include "dmslam/wire/status.h"

namespace dmslam {

/// A loop or a global adjustment that the mapper applied, or a correction that it refused.
struct CorrectionRecord {
  MapEvent event = MapEvent::kCorrected;
  KeyframeId keyframe;
  std::string note;
  std::optional<KeyframeId> matched;  ///< of a loop: its other end, where that is known
  Rigid3d T_matched_keyframe;         ///< of a loop: as it was closed [map units]
};

/// What frames took.
struct FrameDurations {
  DurationHistogram step;   ///< of the frontend
  DurationHistogram apart;  ///< ... without decoding
  DurationHistogram decode, extract;
  DurationHistory image_to_pose;  ///< from when the player published it

  void Add(const FrameTrace& trace);
};

/// As the player said it at the end, or else as far as is known.
struct PlayedFrames {
  int64_t published = 0, missing = 0, blacked = 0, jumped = 0;
  std::optional<uint32_t> first_index = std::nullopt;  ///< none: not announced
};

struct CameraRecord {
  std::string sequence, ground_truth;
  std::vector<StampedPose> heard_ground_truth;  ///< as the player told it: kept where there is no file
  PlayedFrames frames;
  FrontendStatus frontend;
};

struct KeyframeRecord {
  size_t proposed = 0;
  size_t missing = 0;             ///< proposed for a map that stands, and neither in it nor culled from it
  size_t lost_in_crash = 0;       ///< made after the last checkpoint before all died, and not made again
  size_t lost_with_frontend = 0;  ///< their frontend died while no mapper was there to take them
  DurationHistogram to_landmarks, to_adjusted;  ///< from when each was heard to when these were
};

struct MemorySample {
  size_t keyframes = 0;
  double rss_mb = 0;
};

/// What a process's memory was when the map was no longer tiny, and is now.
struct MemoryGrowth {
  std::optional<MemorySample> first;  ///< with ten keyframes or more
  MemorySample last;

  void Add(const MemorySample& sample) {
    if (!first && sample.keyframes >= 10) first = sample;
    last = sample;
  }
};

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

struct WrittenResults {
  std::string table;    ///< the summary, for people
  std::string problem;  ///< the first file that could not be written, and why; empty: all are there
};

/// Writes trajectory.txt, trajectory_online.txt, poses_online.csv, keyframes.txt, map.ply, graph.txt,
/// trajectory.png (where `figure`) and summary.json into `dir`. Each text file is there as a whole or not at
/// all; one that cannot be written does not keep the others from being written. Of several cameras these are
/// of the first one (map and graph of all), and camera 1 has trajectory_1.txt, trajectory_online_1.txt and
/// keyframes_1.txt.
WrittenResults WriteResults(const std::string& dir, RunRecord run, const TrajectoryBuilder& builder,
                            bool figure = true);

}  // namespace dmslam
