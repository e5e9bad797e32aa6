#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/dataset/frame_source.h"
#include "dmslam/settings/settings.h"
#include "schedule.h"

namespace dmslam {
class Vocabulary;
}

namespace dmslam::simulation {

/// A sequence in memory.
struct StoredFrame {
  int64_t stamp_ns = 0;
  EncodedImage image;
};

/// Plays it. The frames must stay where they are.
class StoredFrames : public FrameSource {
 public:
  explicit StoredFrames(const std::vector<StoredFrame>* frames) : frames_(frames) {}
  size_t size() const override { return frames_->size(); }
  int64_t StampNs(size_t index) const override { return (*frames_)[index].stamp_ns; }
  std::string Name(size_t index) const override { return "frame " + std::to_string(index); }
  EncodedImage Read(size_t index) override { return (*frames_)[index].image; }

 private:
  const std::vector<StoredFrame>* frames_;
};

/// What the simulated system works on.
struct Workload {
  Camera camera;
  std::vector<StoredFrame> frames;
  std::shared_ptr<const Vocabulary> vocabulary;
  Settings settings;
};

/// What a run leaves.
struct Outcome {
  std::string failure;                                      ///< empty: all processes have ended well
  std::string trajectory, online, keyframes, map, summary;  ///< the collector's files
  std::string story;                                        ///< what happened when, a line each
  double virtual_s = 0;
  int64_t turns = 0, faults = 0;
  int64_t restarts = 0;  ///< of processes that had ended themselves
  struct Forged {
    Content content;
    uint32_t frame;  ///< so many had been played
  };
  std::vector<Forged> forged;
  /// All processes had died.
  struct Resumed {
    uint32_t at_frame = 0;                    ///< so many had been played
    bool complete = false;                    ///< the last map is on the disk: nothing is left to compute
    bool anew = false;                        ///< nothing was left to resume: it was begun anew
    std::optional<uint32_t> last_frame;       ///< of which there was a word on the disk
    std::optional<uint32_t> newest_keyframe;  ///< of the checkpoint, its frame
    std::set<uint32_t> proposed;  ///< frames that were proposed as keyframes, as far as the disk has it
    std::set<int64_t> written;    ///< stamps of the frames whose poses were in the journal
  };
  std::vector<Resumed> resumed;
  SimulatedNetwork::Statistics network;
};

/// Reads what a collector has left in a folder.
void ReadResults(const std::string& folder, Outcome* outcome);

/// All processes of a run as they are, but for their sockets, clocks, threads and deaths: nodes on a
/// simulated network, in one thread and virtual time, supervised as dmslam-run does. The same schedule gives
/// the same run. `folder` is made anew: the collector's.
Outcome RunSchedule(const Workload& workload, const Schedule& schedule, const std::string& folder);

}  // namespace dmslam::simulation
