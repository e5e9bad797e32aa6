#pragma once

#include <Eigen/Core>
#include <opencv2/core.hpp>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/features/orb_extractor.h"
#include "dmslam/features/types.h"

namespace dmslam::testing {

/// A frame of a TUM RGB-D folder with its true pose.
struct TrueFrame {
  cv::Mat grey;  ///< CV_8UC1
  Eigen::Matrix3d R_cam_world = Eigen::Matrix3d::Identity();
  Eigen::Vector3d t_cam_world = Eigen::Vector3d::Zero();
};

/// The folder of a sequence below the environment variable DMSLAM_DATA (default ../shared/data beside the
/// project); none when it is absent.
std::optional<std::string> SequenceFolder(const std::string& name);

/// Reads every `step`-th frame of a folder, from `first`, at most `count`. Frames without a pose of the same
/// stamp are left out.
std::vector<TrueFrame> LoadFrames(const std::string& folder, int first, int step, int count);

/// Features of either extractor in a common form. Positions are full-resolution pixels, size is the size of a
/// pixel of the level.
struct Features {
  std::vector<Eigen::Vector2d> uv_px;
  std::vector<double> size;
  std::vector<Descriptor> descriptors;
};

Features FromSet(const FeatureSet& set, const Pyramid& pyramid);
/// cv::ORB with default parameters but for the number of features.
Features FromCvOrb(const cv::Mat& grey, int num_features);

/// Depth at pixels of the first frame of a pair, from points that both extractors' matches give under the
/// true poses.
class PairGeometry {
 public:
  PairGeometry(const TrueFrame& frame0, const TrueFrame& frame1);

  /// Distance of uv1 from the epipolar line of uv0 [px].
  double EpipolarError(const Eigen::Vector2d& uv0_px, const Eigen::Vector2d& uv1_px) const;
  /// Where a pixel of frame 0 shows in frame 1, judged by the depth of its neighbours; none where they are
  /// absent or do not agree, or the place is outside the image or within 20 px of its edge.
  std::optional<Eigen::Vector2d> Transfer(const Eigen::Vector2d& uv0_px) const;

 private:
  struct DepthPoint {
    Eigen::Vector2d uv0_px;
    double inverse_depth;
  };
  void AddPoints(const Features& features0, const Features& features1);
  Eigen::Vector2d Project(const Eigen::Vector2d& uv0_px, double inverse_depth) const;

  Eigen::Matrix3d R_1_0_;
  Eigen::Vector3d t_1_0_;
  Eigen::Matrix3d F_;
  int width_, height_;
  std::vector<DepthPoint> points_;
};

/// Sums over pairs.
struct Quality {
  int pairs = 0;
  size_t features = 0;      ///< of the first frames
  size_t transferable = 0;  ///< features whose place in the second frame is known
  size_t repeated = 0;  ///< of these, such with a feature within 2.5 px (of their level's pixels at most 5)
  size_t matches = 0;   ///< mutual nearest neighbours with ratio 0.8
  size_t inliers = 0;   ///< of these, within 2 px of the epipolar line and, where known, 4 px of their place
  std::vector<double> errors_px;  ///< epipolar errors of the inliers
  std::vector<double> coverages;  ///< per pair: share of 40 px cells of the image that hold an inlier

  double Repeatability() const { return static_cast<double>(repeated) / static_cast<double>(transferable); }
  double MeanInliers() const { return static_cast<double>(inliers) / pairs; }
  double Precision() const { return static_cast<double>(inliers) / static_cast<double>(matches); }
  double MedianErrorPx() const;
  double MeanCoverage() const;
};

void AddPair(const Features& features0, const Features& features1, const PairGeometry& geometry,
             Quality* quality);

}  // namespace dmslam::testing
