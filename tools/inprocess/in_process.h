#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "collector/make_collector.h"
#include "dmslam/recording/log_index.h"
#include "mapper/make_mapper.h"
#include "player/player_node.h"

namespace dmslam {

class Vocabulary;

/// A whole run in one process: the nodes of the four processes and of the collector on a bus in memory, in
/// lock-step, under a virtual clock, one thread. Gives the same bytes as the processes do.
struct InProcessOptions {
  NodeOptions node;  ///< settings; session and peers are set by the run
  PlayerOptions player;
  CollectorOptions collector;
  std::shared_ptr<const Vocabulary> vocabulary;
  std::string picture_dir;
  int picture_every = 0;
  bool progress = false;
  MapperFiles map_files;       ///< maps to begin with and to save
  std::string record;          ///< log of all that is said; empty: none
  std::function<bool()> stop;  ///< asked between steps: whether to write what there is and end; empty: never
};

/// Returns the collector's exit code; what went wrong is in `problem`. Instead of frames the frontend's
/// records of a log are entered: mapper, loop closer and collector, without frontend and player.
int RunRecordsInProcess(InProcessOptions options, std::shared_ptr<const LogIndex> log, uint32_t log_session,
                        std::string* problem);

/// A camera beside the first one: what is played, and how.
struct AnotherCamera {
  PlayerOptions player;
  std::unique_ptr<FrameSource> source;
};

/// Returns the collector's exit code; what went wrong is in `problem`.
int RunInProcess(InProcessOptions options, std::unique_ptr<FrameSource> source, std::string* problem,
                 std::vector<AnotherCamera> others = {});

}  // namespace dmslam
