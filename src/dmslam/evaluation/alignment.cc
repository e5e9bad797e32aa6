#include "dmslam/evaluation/alignment.h"

#include "dmslam/geometry/svd.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

// A singular value this small against the largest counts as zero: the points lie on a line.
constexpr double kRankTolerance = 1e-12;

struct Moments {
  Eigen::Vector3d source_mean = Eigen::Vector3d::Zero();
  Eigen::Vector3d target_mean = Eigen::Vector3d::Zero();
  double source_variance = 0;
  Eigen::Matrix3d covariance = Eigen::Matrix3d::Zero();  // target times source
};

Moments ComputeMoments(std::span<const Eigen::Vector3d> source, std::span<const Eigen::Vector3d> target) {
  Moments moments;
  const double n = static_cast<double>(source.size());
  for (size_t i = 0; i < source.size(); ++i) {
    moments.source_mean += source[i];
    moments.target_mean += target[i];
  }
  moments.source_mean /= n;
  moments.target_mean /= n;
  for (size_t i = 0; i < source.size(); ++i) {
    const Eigen::Vector3d centred = source[i] - moments.source_mean;
    moments.source_variance += centred.squaredNorm();
    moments.covariance += (target[i] - moments.target_mean) * centred.transpose();
  }
  moments.source_variance /= n;
  moments.covariance /= n;
  return moments;
}

}  // namespace

std::string_view AlignmentName(Alignment alignment) {
  switch (alignment) {
    case Alignment::kNone:
      return "none";
    case Alignment::kScale:
      return "scale";
    case Alignment::kSe3:
      return "se3";
    case Alignment::kSim3:
      return "sim3";
  }
  return "none";
}

std::optional<Alignment> ParseAlignment(std::string_view name) {
  for (const Alignment alignment : {Alignment::kNone, Alignment::kScale, Alignment::kSe3, Alignment::kSim3}) {
    if (AlignmentName(alignment) == name) return alignment;
  }
  return std::nullopt;
}

std::optional<Sim3d> AlignPoints(std::span<const Eigen::Vector3d> source,
                                 std::span<const Eigen::Vector3d> target, Alignment alignment) {
  DMSLAM_CHECK(source.size() == target.size(), "points come in pairs");
  if (alignment == Alignment::kNone) return Sim3d();
  if (source.size() < 3) return std::nullopt;
  const Moments moments = ComputeMoments(source, target);
  const Svd3 svd = SvdOf(moments.covariance);
  const Eigen::Vector3d& singular = svd.values;
  if (!(singular(1) > kRankTolerance * singular(0)) || !(moments.source_variance > 0)) return std::nullopt;

  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if (svd.U.determinant() * svd.V.determinant() < 0) signs.z() = -1;
  const Eigen::Matrix3d rotation = svd.U * signs.asDiagonal() * svd.V.transpose();
  const double scale = singular.dot(signs) / moments.source_variance;
  if (alignment == Alignment::kScale) {
    return Sim3d(Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero(), scale);
  }
  const double kept_scale = alignment == Alignment::kSim3 ? scale : 1.0;
  return Sim3d(Eigen::Quaterniond(rotation).normalized(),
               moments.target_mean - kept_scale * (rotation * moments.source_mean), kept_scale);
}

}  // namespace dmslam
