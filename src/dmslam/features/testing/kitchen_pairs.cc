#include "dmslam/features/testing/kitchen_pairs.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <map>
#include <opencv2/features2d.hpp>
#include <opencv2/imgcodecs.hpp>
#include <set>
#include <sstream>

#include "dmslam/features/matcher.h"

namespace dmslam::testing {
namespace {

constexpr double kFocalPx = 525.505, kCenterX = 320.0, kCenterY = 240.0;

Eigen::Vector3d Ray(const Eigen::Vector2d& uv) {
  return {(uv.x() - kCenterX) / kFocalPx, (uv.y() - kCenterY) / kFocalPx, 1.0};
}

/// Lines of a text table that are no comments, split at the first blank: stamp text -> the rest.
std::map<std::string, std::string> ReadTable(const std::string& path) {
  std::map<std::string, std::string> rows;
  std::ifstream in(path);
  for (std::string line; std::getline(in, line);) {
    const size_t blank = line.find(' ');
    if (line.empty() || line[0] == '#' || blank == std::string::npos) continue;
    rows[line.substr(0, blank)] = line.substr(blank + 1);
  }
  return rows;
}

std::vector<FeatureMatch> MutualMatches(const Features& a, const Features& b, double max_ratio) {
  const std::vector<Keypoint> keypoints_a(a.descriptors.size()), keypoints_b(b.descriptors.size());
  std::vector<FeatureMatch> matches;
  FeatureMatcher().MatchAll({keypoints_a, a.descriptors}, {keypoints_b, b.descriptors},
                            {.max_distance = 64, .max_ratio = max_ratio, .check_orientation = false},
                            &matches);
  return matches;
}

}  // namespace

std::optional<std::string> SequenceFolder(const std::string& name) {
  std::string root;
  if (const char* data = std::getenv("DMSLAM_DATA")) {
    root = data;
  } else if (const char* source = std::getenv("DMSLAM_SOURCE_DIR")) {
    root = std::string(source) + "/../shared/data";
  } else {
    root = "../shared/data";
  }
  const std::string folder = root + "/" + name;
  if (!std::filesystem::is_directory(folder)) return std::nullopt;
  return folder;
}

std::vector<TrueFrame> LoadFrames(const std::string& folder, int first, int step, int count) {
  const auto images = ReadTable(folder + "/rgb.txt");
  const auto poses = ReadTable(folder + "/groundtruth.txt");
  std::vector<TrueFrame> frames;
  int index = -1;
  for (const auto& [stamp, file] : images) {
    ++index;
    if (index < first || (index - first) % step != 0) continue;
    if (static_cast<int>(frames.size()) == count) break;
    const auto pose = poses.find(stamp);
    if (pose == poses.end()) continue;
    std::istringstream values(pose->second);
    Eigen::Vector3d t;
    Eigen::Quaterniond q;
    values >> t.x() >> t.y() >> t.z() >> q.x() >> q.y() >> q.z() >> q.w();
    TrueFrame frame;
    frame.grey = cv::imread(std::string(folder).append("/").append(file), cv::IMREAD_GRAYSCALE);
    frame.R_cam_world = q.normalized().toRotationMatrix().transpose();
    frame.t_cam_world = -(frame.R_cam_world * t);
    frames.push_back(frame);
  }
  return frames;
}

Features FromSet(const FeatureSet& set, const Pyramid& pyramid) {
  Features features;
  features.descriptors.assign(set.descriptors.begin(), set.descriptors.end());
  for (const Keypoint& keypoint : set.keypoints) {
    features.uv_px.emplace_back(keypoint.x_px(), keypoint.y_px());
    features.size.push_back(pyramid.Scale(keypoint.octave));
  }
  return features;
}

Features FromCvOrb(const cv::Mat& grey, int num_features) {
  std::vector<cv::KeyPoint> keypoints;
  cv::Mat descriptors;
  cv::ORB::create(num_features)->detectAndCompute(grey, cv::noArray(), keypoints, descriptors);
  Features features;
  features.descriptors.resize(keypoints.size());
  for (size_t i = 0; i < keypoints.size(); ++i) {
    features.uv_px.emplace_back(keypoints[i].pt.x, keypoints[i].pt.y);
    features.size.push_back(std::pow(1.2, keypoints[i].octave));
    std::memcpy(features.descriptors[i].words.data(), descriptors.ptr(static_cast<int>(i)), 32);
  }
  return features;
}

PairGeometry::PairGeometry(const TrueFrame& frame0, const TrueFrame& frame1)
    : R_1_0_(frame1.R_cam_world * frame0.R_cam_world.transpose()),
      t_1_0_(frame1.t_cam_world - R_1_0_ * frame0.t_cam_world),
      width_(frame0.grey.cols),
      height_(frame0.grey.rows) {
  Eigen::Matrix3d K_inverse;
  K_inverse << 1 / kFocalPx, 0, -kCenterX / kFocalPx, 0, 1 / kFocalPx, -kCenterY / kFocalPx, 0, 0, 1;
  Eigen::Matrix3d hat;
  hat << 0, -t_1_0_.z(), t_1_0_.y(), t_1_0_.z(), 0, -t_1_0_.x(), -t_1_0_.y(), t_1_0_.x(), 0;
  F_ = K_inverse.transpose() * hat * R_1_0_ * K_inverse;
  AddPoints(FromCvOrb(frame0.grey, 4000), FromCvOrb(frame1.grey, 4000));
  OrbExtractorOptions options;
  options.num_features = 4000;
  OrbExtractor extractor(options);
  FeatureSet set0, set1;
  const auto view = [](const cv::Mat& m) {
    return GrayView{m.ptr<uint8_t>(), m.cols, m.rows, static_cast<ptrdiff_t>(m.step[0])};
  };
  extractor.Extract(view(frame0.grey), &set0);
  extractor.Extract(view(frame1.grey), &set1);
  AddPoints(FromSet(set0, options.pyramid), FromSet(set1, options.pyramid));
}

double PairGeometry::EpipolarError(const Eigen::Vector2d& uv0_px, const Eigen::Vector2d& uv1_px) const {
  const Eigen::Vector3d line = F_ * uv0_px.homogeneous();
  return std::abs(line.dot(uv1_px.homogeneous())) / line.head<2>().norm();
}

Eigen::Vector2d PairGeometry::Project(const Eigen::Vector2d& uv0_px, double inverse_depth) const {
  const Eigen::Vector3d p = R_1_0_ * Ray(uv0_px) + inverse_depth * t_1_0_;
  return {kFocalPx * p.x() / p.z() + kCenterX, kFocalPx * p.y() / p.z() + kCenterY};
}

void PairGeometry::AddPoints(const Features& features0, const Features& features1) {
  for (const FeatureMatch& match : MutualMatches(features0, features1, 0.8)) {
    const Eigen::Vector2d& uv0 = features0.uv_px[match.index0];
    const Eigen::Vector2d& uv1 = features1.uv_px[match.index1];
    if (EpipolarError(uv0, uv1) > 2.0) continue;
    // Inverse depth from the two equations u1 (r3 + w t3) = r1 + w t1, least squares.
    const Eigen::Vector3d r = R_1_0_ * Ray(uv0);
    const Eigen::Vector3d x1 = Ray(uv1);
    const Eigen::Vector2d a = t_1_0_.head<2>() - x1.head<2>() * t_1_0_.z();
    const Eigen::Vector2d b = x1.head<2>() * r.z() - r.head<2>();
    const double inverse_depth = a.dot(b) / a.squaredNorm();
    if ((Project(uv0, inverse_depth) - uv1).norm() > 2.0) continue;
    points_.push_back({uv0, inverse_depth});
  }
}

std::optional<Eigen::Vector2d> PairGeometry::Transfer(const Eigen::Vector2d& uv0_px) const {
  constexpr double kReachPx = 12.0, kAgreementPx = 2.0, kMarginPx = 20.0;
  std::vector<double> inverse_depths;
  for (const DepthPoint& point : points_) {
    if ((point.uv0_px - uv0_px).squaredNorm() < kReachPx * kReachPx)
      inverse_depths.push_back(point.inverse_depth);
  }
  if (inverse_depths.size() < 3) return std::nullopt;
  std::sort(inverse_depths.begin(), inverse_depths.end());
  const size_t n = inverse_depths.size();
  const Eigen::Vector2d uv1 = Project(uv0_px, inverse_depths[n / 2]);
  const Eigen::Vector2d low = Project(uv0_px, inverse_depths[n / 4]);
  const Eigen::Vector2d high = Project(uv0_px, inverse_depths[n - 1 - n / 4]);
  if ((low - high).norm() > kAgreementPx) return std::nullopt;
  const bool inside = uv1.x() > kMarginPx && uv1.y() > kMarginPx && uv1.x() < width_ - kMarginPx &&
                      uv1.y() < height_ - kMarginPx;
  if (!inside) return std::nullopt;
  return uv1;
}

double Quality::MedianErrorPx() const {
  std::vector<double> sorted = errors_px;
  std::sort(sorted.begin(), sorted.end());
  return sorted.empty() ? 0.0 : sorted[sorted.size() / 2];
}

double Quality::MeanCoverage() const {
  double sum = 0.0;
  for (const double coverage : coverages) sum += coverage;
  return coverages.empty() ? 0.0 : sum / static_cast<double>(coverages.size());
}

void AddPair(const Features& features0, const Features& features1, const PairGeometry& geometry,
             Quality* quality) {
  constexpr double kCellPx = 40.0, kCells = 16 * 12;
  ++quality->pairs;
  quality->features += features0.uv_px.size();
  for (size_t i = 0; i < features0.uv_px.size(); ++i) {
    const auto place = geometry.Transfer(features0.uv_px[i]);
    if (!place) continue;
    ++quality->transferable;
    bool repeated = false;
    for (size_t j = 0; j < features1.uv_px.size() && !repeated; ++j) {
      const double size_ratio = features0.size[i] / features1.size[j];
      repeated =
          (features1.uv_px[j] - *place).squaredNorm() < 2.5 * 2.5 && size_ratio < 1.3 && size_ratio > 0.75;
    }
    quality->repeated += repeated ? 1 : 0;
  }
  std::set<std::pair<int, int>> cells;
  for (const FeatureMatch& match : MutualMatches(features0, features1, 0.8)) {
    const Eigen::Vector2d& uv0 = features0.uv_px[match.index0];
    const Eigen::Vector2d& uv1 = features1.uv_px[match.index1];
    ++quality->matches;
    const double error = geometry.EpipolarError(uv0, uv1);
    const auto place = geometry.Transfer(uv0);
    if (error > 2.0 || (place && (*place - uv1).norm() > 4.0)) continue;
    ++quality->inliers;
    quality->errors_px.push_back(error);
    cells.insert({static_cast<int>(uv0.x() / kCellPx), static_cast<int>(uv0.y() / kCellPx)});
  }
  quality->coverages.push_back(static_cast<double>(cells.size()) / kCells);
}

}  // namespace dmslam::testing
