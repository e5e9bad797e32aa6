#pragma once

#include <string>

#include "collector/run_record.h"
#include "dmslam/slam/trajectory_builder.h"

namespace dmslam {

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
