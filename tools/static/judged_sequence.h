#pragma once

#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/dataset/image.h"
#include "dmslam/dataset/trajectory.h"
#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/features/frame_features.h"
#include "dmslam/features/orb_extractor.h"
#include "dmslam/motion_segmentation/match.h"

namespace dmslam {

/// What masks and true poses say about a match between two frames.
enum class MatchTruth : uint8_t {
  kStatic,    ///< on the background, and where the true motion puts it
  kMismatch,  ///< on the background, but elsewhere: left out of recall
  kMoving,    ///< on something that moves, in either frame
  kNeither,   ///< on an actor who stands still in both frames: neither right nor wrong
};

/// Throws InputError, naming `name`, where an image has not the camera's size.
void CheckImageSize(const std::string& name, const GrayImage& image, const Camera& camera);

/// A recording with features, and with masks and true poses where it has them; these only judge. Features and
/// masks are kept once they were asked for.
class JudgedSequence {
 public:
  /// Throws InputError where the folder is no sequence.
  JudgedSequence(const std::string& folder, const Camera& camera, int num_features);

  size_t size() const { return source_.size(); }
  const Camera& camera() const { return camera_; }
  int64_t StampNs(size_t frame) const { return source_.StampNs(frame); }
  ColorImage Color(size_t frame);
  /// Throws InputError where the image has not the camera's size.
  std::shared_ptr<const FrameFeatures> Features(size_t frame);
  bool HasMasks() const { return !source_.masks().empty(); }
  bool HasPoses() const { return !poses_.empty(); }
  /// True pose T_cam_world; none where the ground truth has nothing within 20 ms.
  std::optional<Rigid3d> TruePose(size_t frame) const;
  /// True T_1_0 of two frames.
  std::optional<Rigid3d> TrueMotion(size_t frame0, size_t frame1) const;
  /// The mask's value under a raw pixel; 0 where there is no mask.
  uint8_t MaskAt(size_t frame, const Keypoint& keypoint);
  /// What each match is. Without poses every match on the background counts as static.
  std::vector<MatchTruth> Judge(size_t frame0, size_t frame1, std::span<const Match> matches);
  /// Forgets features and masks of frames before `frame`.
  void ForgetBefore(size_t frame);

 private:
  TumSequence source_;
  Camera camera_;
  OrbExtractor extractor_;
  std::vector<StampedPose> poses_;
  std::map<size_t, std::shared_ptr<const FrameFeatures>> features_;
  std::map<size_t, GrayImage> masks_;
};

/// Precision and recall of one answer.
struct SelectionScore {
  int num_static = 0;      ///< called static and judged (kNeither is not)
  int num_right = 0;       ///< of these, not moving
  int num_true = 0;        ///< static matches there are
  int num_true_found = 0;  ///< of these, called static
  int num_moving = 0;      ///< moving matches there are
  int num_matches = 0;

  double precision() const { return num_static == 0 ? 1.0 : num_right / static_cast<double>(num_static); }
  double recall() const { return num_true == 0 ? 1.0 : num_true_found / static_cast<double>(num_true); }
  double moving_share() const {
    return num_matches == 0 ? 0.0 : num_moving / static_cast<double>(num_matches);
  }
};
SelectionScore ScoreSelection(std::span<const MatchTruth> truth, std::span<const uint8_t> is_static);

}  // namespace dmslam
