#include "collector/played_sequences.h"

#include <algorithm>
#include <sstream>
#include <utility>

namespace dmslam {

void PlayedSequences::ReadNote(const std::string& kind, std::istream& text) {
  CameraId camera = 0;
  if ((kind != "frames" && kind != "end") || !(text >> camera)) return;
  if (kind == "frames") {
    Announced& announced = announced_[camera];
    text >> announced.num_frames >> announced.first_frame;
  } else if (camera < num_cameras_) {
    EndOfSequence& end = ended_[camera];
    end.camera_id = camera;
    text >> end.frames_published >> end.frames_missing >> end.frames_blacked >> end.frames_jumped;
  }
}

/// What was announced before is noted now, unless it was noted by a collector before this one.
void PlayedSequences::NoteTo(Note note) {
  note_ = std::move(note);
  for (const auto& [camera, announced] : announced_early_) {
    if (announced_.emplace(camera, announced).second) NoteAnnounced(camera, announced);
  }
  announced_early_.clear();
}

void PlayedSequences::Announce(CameraId camera, std::optional<int64_t> num_frames, uint32_t first_frame) {
  if (!num_frames) return;
  const Announced announced{*num_frames, first_frame};
  if (!note_) {
    announced_early_.emplace(camera, announced);
  } else if (announced_.emplace(camera, announced).second) {
    NoteAnnounced(camera, announced);
  }
}

void PlayedSequences::NoteAnnounced(CameraId camera, const Announced& announced) const {
  note_("frames " + std::to_string(camera) + " " + std::to_string(announced.num_frames) + " " +
        std::to_string(announced.first_frame));
}

/// The newest word counts; what is said again need not be noted again.
void PlayedSequences::OnEnd(const EndOfSequence& end) {
  if (end.camera_id >= num_cameras_) return;
  ended_[end.camera_id] = end;
  if (!note_ || !noted_.insert(end.camera_id).second) return;
  std::ostringstream note;
  note << "end " << end.camera_id << ' ' << end.frames_published << ' ' << end.frames_missing << ' '
       << end.frames_blacked << ' ' << end.frames_jumped;
  note_(note.str());
}

void PlayedSequences::OnPublished(CameraId camera, int64_t frames) {
  if (camera >= num_cameras_) return;
  int64_t& published = published_[camera];
  published = std::max(published, frames);
}

std::optional<int64_t> PlayedSequences::NumFrames() const {
  int64_t total = 0;
  for (const auto& [camera, announced] : announced_) total += announced.num_frames;
  return total > 0 ? std::optional(total) : std::nullopt;
}

/// Where the player's last word was not heard. A frame that never came to the frontend has no pose that could
/// be counted, but a number; and where the frontend is gone, the player still says how many it has played.
int64_t PlayedSequences::PublishedAsFarAsKnown(CameraId camera, const FramePoses& poses, bool is_over) const {
  const auto announced = announced_.find(camera);
  if (is_over && announced != announced_.end()) return announced->second.num_frames;
  std::optional<uint32_t> first, last;
  for (const auto& [frame, pose] : poses) {
    if (frame.camera != camera) continue;
    if (!first) first = frame.index;
    last = frame.index;
  }
  const auto said = published_.find(camera);
  const int64_t span = first ? int64_t{*last} - *first + 1 : 0;
  const int64_t played = std::max(span, said == published_.end() ? 0 : said->second);
  return announced == announced_.end() ? played : std::min(played, announced->second.num_frames);
}

void PlayedSequences::Fill(const FramePoses& poses, bool is_over, RunRecord* run) const {
  for (CameraId camera = 0; camera < num_cameras_; ++camera)
    run->cameras[camera].frames.published = PublishedAsFarAsKnown(camera, poses, is_over);
  for (const auto& [camera, end] : ended_)
    run->cameras[camera].frames = {end.frames_published, end.frames_missing, end.frames_blacked,
                                   end.frames_jumped};
  for (const auto& [camera, announced] : announced_)
    if (camera < num_cameras_) run->cameras[camera].frames.first_index = announced.first_frame;
  run->end_heard = ended_.contains(0);
}

}  // namespace dmslam
