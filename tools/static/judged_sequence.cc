#include "judged_sequence.h"

#include <algorithm>
#include <cmath>

#include "dmslam/geometry/two_view.h"
#include "dmslam/map/keyframe.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr int64_t kPoseToleranceNs = 20'000'000;
constexpr double kTruePx = 3.0;          // epipolar error of a true match
constexpr double kPureRotationM = 1e-3;  // baseline below which there are no epipolar lines

OrbExtractorOptions Extraction(int num_features) {
  OrbExtractorOptions options;
  options.num_features = num_features;
  return options;
}

/// Distance of a match to what the true motion allows [px].
double TrueError(const Rigid3d& T_1_0, const Eigen::Matrix3d& F, const Camera& camera, const Match& match) {
  if (T_1_0.translation.norm() < kPureRotationM) {
    const auto moved = camera.Project(T_1_0.rotation * camera.Ray(match.uv0_px));
    return moved ? (*moved - match.uv1_px).norm() : 1e9;
  }
  return std::sqrt(std::max(EpipolarDistanceSquared(F, match.uv0_px, match.uv1_px),
                            EpipolarDistanceSquared(F.transpose(), match.uv1_px, match.uv0_px)));
}

}  // namespace

void CheckImageSize(const std::string& name, const GrayImage& image, const Camera& camera) {
  if (image.width == camera.width_px && image.height == camera.height_px) return;
  throw InputError(name + ": " + std::to_string(image.width) + "x" + std::to_string(image.height) +
                   " pixels, but the camera has " + std::to_string(camera.width_px) + "x" +
                   std::to_string(camera.height_px));
}

JudgedSequence::JudgedSequence(const std::string& folder, const Camera& camera, int num_features)
    : source_(folder), camera_(camera), extractor_(Extraction(num_features)) {
  if (const auto path = source_.GroundTruthPath()) poses_ = ReadGroundTruth(*path).poses;
}

ColorImage JudgedSequence::Color(size_t frame) {
  return DecodeColor(source_.Read(frame), source_.Name(frame));
}

std::shared_ptr<const FrameFeatures> JudgedSequence::Features(size_t frame) {
  auto& cached = features_[frame];
  if (!cached) {
    const GrayImage image = DecodeGray(source_.Read(frame), source_.Name(frame));
    CheckImageSize(source_.Name(frame), image, camera_);
    FeatureSet set;
    extractor_.Extract({image.data.data(), image.width, image.height, image.width}, &set);
    cached = MakeFrameFeatures(std::move(set), camera_, Pyramid());
  }
  return cached;
}

std::optional<Rigid3d> JudgedSequence::TruePose(size_t frame) const {
  const int64_t stamp = source_.StampNs(frame);
  const auto later = std::lower_bound(poses_.begin(), poses_.end(), stamp,
                                      [](const StampedPose& pose, int64_t t) { return pose.stamp_ns < t; });
  const StampedPose* nearest = nullptr;
  for (auto it = later == poses_.begin() ? later : later - 1; it != poses_.end() && it <= later; ++it) {
    if (!nearest || std::abs(it->stamp_ns - stamp) < std::abs(nearest->stamp_ns - stamp)) nearest = &*it;
  }
  if (!nearest || std::abs(nearest->stamp_ns - stamp) > kPoseToleranceNs) return std::nullopt;
  return nearest->T_world_cam.Inverse();
}

std::optional<Rigid3d> JudgedSequence::TrueMotion(size_t frame0, size_t frame1) const {
  const auto T_0 = TruePose(frame0), T_1 = TruePose(frame1);
  if (!T_0 || !T_1) return std::nullopt;
  return *T_1 * T_0->Inverse();
}

uint8_t JudgedSequence::MaskAt(size_t frame, const Keypoint& keypoint) {
  if (!HasMasks()) return 0;
  auto [it, fresh] = masks_.try_emplace(frame);
  if (fresh) {
    if (const auto file = FindNearest(source_.masks(), source_.StampNs(frame), kPoseToleranceNs)) {
      it->second = LoadGray(file->path);
    }
  }
  const GrayImage& mask = it->second;
  if (mask.empty()) return 0;
  const int x = std::clamp(static_cast<int>(std::lround(keypoint.x_px())), 0, mask.width - 1);
  const int y = std::clamp(static_cast<int>(std::lround(keypoint.y_px())), 0, mask.height - 1);
  return mask.at(x, y);
}

std::vector<MatchTruth> JudgedSequence::Judge(size_t frame0, size_t frame1, std::span<const Match> matches) {
  const auto motion = TrueMotion(frame0, frame1);
  Eigen::Matrix3d F = Eigen::Matrix3d::Zero();
  if (motion && motion->translation.norm() >= kPureRotationM) {
    F = FundamentalFromEssential(EssentialFromPose(*motion), camera_.Ideal(), camera_.Ideal());
  }
  const auto features0 = Features(frame0), features1 = Features(frame1);
  std::vector<MatchTruth> truth;
  truth.reserve(matches.size());
  for (const Match& match : matches) {
    const uint8_t mask0 = MaskAt(frame0, features0->set.keypoints[match.index0]);
    const uint8_t mask1 = MaskAt(frame1, features1->set.keypoints[match.index1]);
    if (mask0 == 255 || mask1 == 255) {
      truth.push_back(MatchTruth::kMoving);
    } else if (mask0 == 128 && mask1 == 128) {
      truth.push_back(MatchTruth::kNeither);
    } else if (motion && !(TrueError(*motion, F, camera_, match) <= kTruePx)) {
      truth.push_back(MatchTruth::kMismatch);
    } else {
      truth.push_back(MatchTruth::kStatic);
    }
  }
  return truth;
}

void JudgedSequence::ForgetBefore(size_t frame) {
  features_.erase(features_.begin(), features_.lower_bound(frame));
  masks_.erase(masks_.begin(), masks_.lower_bound(frame));
}

SelectionScore ScoreSelection(std::span<const MatchTruth> truth, std::span<const uint8_t> is_static) {
  SelectionScore score;
  score.num_matches = static_cast<int>(truth.size());
  for (size_t i = 0; i < truth.size(); ++i) {
    score.num_moving += truth[i] == MatchTruth::kMoving;
    score.num_true += truth[i] == MatchTruth::kStatic;
    if (!is_static[i] || truth[i] == MatchTruth::kNeither) continue;
    ++score.num_static;
    score.num_right += truth[i] != MatchTruth::kMoving;
    score.num_true_found += truth[i] == MatchTruth::kStatic;
  }
  return score;
}

}  // namespace dmslam
