#include "dmslam/evaluation/alignment.h"

#include "dmslam/geometry/svd.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

// A singular value this small against the largest counts as zero: the points lie on a line.
constexpr double kRankTolerance = 1e-12;

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

/// Welford, "Note on a method for calculating corrected sums of squares and products", Technometrics 1962.
void PointPairs::Add(const Eigen::Vector3d& source, const Eigen::Vector3d& target) {
  const double share = 1.0 / static_cast<double>(++count_);
  const Eigen::Vector3d from_mean = source - source_mean_;
  source_mean_ += share * from_mean;
  target_mean_ += share * (target - target_mean_);
  source_squares_ += from_mean.dot(source - source_mean_);
  products_ += (target - target_mean_) * from_mean.transpose();
}

std::optional<Sim3d> PointPairs::Align(Alignment alignment) const {
  if (alignment == Alignment::kNone) return Sim3d();
  if (count_ < 3) return std::nullopt;
  const Svd3 svd = SvdOf(products_);
  const Eigen::Vector3d& singular = svd.values;
  if (!(singular(1) > kRankTolerance * singular(0)) || !(source_squares_ > 0)) return std::nullopt;

  Eigen::Vector3d signs = Eigen::Vector3d::Ones();
  if (svd.U.determinant() * svd.V.determinant() < 0) signs.z() = -1;
  const Eigen::Matrix3d rotation = svd.U * signs.asDiagonal() * svd.V.transpose();
  const double scale = singular.dot(signs) / source_squares_;
  if (alignment == Alignment::kScale) {
    return Sim3d(Eigen::Quaterniond::Identity(), Eigen::Vector3d::Zero(), scale);
  }
  const double kept_scale = alignment == Alignment::kSim3 ? scale : 1.0;
  return Sim3d(Eigen::Quaterniond(rotation).normalized(),
               target_mean_ - kept_scale * (rotation * source_mean_), kept_scale);
}

std::optional<Sim3d> AlignPoints(std::span<const Eigen::Vector3d> source,
                                 std::span<const Eigen::Vector3d> target, Alignment alignment) {
  DMSLAM_CHECK(source.size() == target.size(), "points come in pairs");
  PointPairs pairs;
  for (size_t i = 0; i < source.size(); ++i) pairs.Add(source[i], target[i]);
  return pairs.Align(alignment);
}

}  // namespace dmslam
