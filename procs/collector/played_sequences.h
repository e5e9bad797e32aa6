#pragma once

#include <cstdint>
#include <functional>
#include <istream>
#include <map>
#include <optional>
#include <set>
#include <string>

#include "collector/run_record.h"
#include "dmslam/slam/trajectory_builder.h"
#include "dmslam/wire/player_messages.h"

namespace dmslam {

/// What the players say of their sequences: how many frames each has, and that it has ended. What a collector
/// after this one must know of it goes into the journal as notes: a player may have left by then.
class PlayedSequences {
 public:
  using Note = std::function<void(const std::string&)>;
  using FramePoses = std::map<TrajectoryBuilder::FrameName, FramePose>;
  /// Of cameras beyond these nothing is believed.
  explicit PlayedSequences(CameraId num_cameras) : num_cameras_(num_cameras) {}

  /// A note of this class's kinds, "frames" or "end"; `text` stands behind the kind. Others are not read.
  void ReadNote(const std::string& kind, std::istream& text);
  /// There is a journal, and what a collector before this one has noted is read.
  void NoteTo(Note note);

  /// How many frames a sequence has, and the index of the first; the first word counts. A live camera (none)
  /// announces nothing.
  void Announce(CameraId camera, std::optional<int64_t> num_frames, uint32_t first_frame);
  void OnEnd(const EndOfSequence& end);
  /// How many frames a player has published so far, as its status says.
  void OnPublished(CameraId camera, int64_t frames);

  bool AnyEnded() const { return !ended_.empty(); }
  bool AllEnded() const { return ended_.size() >= num_cameras_; }
  /// Frames of all cameras that announced them; none: no camera has.
  std::optional<int64_t> NumFrames() const;
  /// How many frames there were, as the players said it at the end, or else as far as is known. `poses`: of
  /// the frames that came to the frontends. `is_over`: the run has come to its end.
  void Fill(const FramePoses& poses, bool is_over, RunRecord* run) const;

 private:
  struct Announced {
    int64_t num_frames = 0;
    uint32_t first_frame = 0;
  };
  int64_t PublishedAsFarAsKnown(CameraId camera, const FramePoses& poses, bool is_over) const;
  void NoteAnnounced(CameraId camera, const Announced& announced) const;

  CameraId num_cameras_;
  std::map<CameraId, Announced> announced_, announced_early_;  ///< early: before there was a journal
  std::map<CameraId, EndOfSequence> ended_;
  std::map<CameraId, int64_t> published_;  ///< the most that a player has said so far
  std::set<CameraId> noted_;               ///< of those that have ended, in the journal
  Note note_;                              ///< empty before there is a journal
};

}  // namespace dmslam
