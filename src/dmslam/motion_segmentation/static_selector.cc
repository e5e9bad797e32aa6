#include "dmslam/motion_segmentation/static_selector.h"

#include <Eigen/Geometry>
#include <algorithm>
#include <cmath>

#include "dmslam/camera/image_scale.h"
#include "dmslam/motion_segmentation/dlrsac.h"
#include "dmslam/motion_segmentation/ransac.h"
#include "dmslam/util/check.h"

namespace dmslam {

std::string_view ToString(Refusal refusal) {
  switch (refusal) {
    case Refusal::kNone:
      return "none";
    case Refusal::kTooFewMatches:
      return "too few matches";
    case Refusal::kBadInput:
      return "bad input";
    case Refusal::kNoMotion:
      return "no motion";
    case Refusal::kTooFewCells:
      return "too few cells";
    case Refusal::kNoModel:
      return "no model";
    case Refusal::kTooFewStatic:
      return "too few static matches";
    case Refusal::kDistributionTooSmall:
      return "distribution too small";
    case Refusal::kAmbiguous:
      return "ambiguous";
  }
  return "unknown";
}

std::string_view ToString(CellState state) {
  switch (state) {
    case CellState::kTooFew:
      return "too few";
    case CellState::kNoModel:
      return "no model";
    case CellState::kCollinear:
      return "collinear";
    case CellState::kPlane:
      return "plane";
    case CellState::kPureRotation:
      return "pure rotation";
    case CellState::kGeneral:
      return "general";
  }
  return "unknown";
}

bool LiesWithinReach(const Eigen::Vector2d& uv_px, const Camera& camera, const InputOptions& options) {
  const double outside = 0.5 + (camera.HasDistortion() ? options.outside_share * camera.width_px : 0.0);
  return uv_px.x() >= -outside && uv_px.y() >= -outside && uv_px.x() <= camera.width_px - 1 + outside &&
         uv_px.y() <= camera.height_px - 1 + outside;  // False for NaN.
}

std::optional<InputProblem> CheckMatches(std::span<const Match> matches, const Camera& camera,
                                         const InputOptions& options) {
  const auto needed = static_cast<size_t>(std::max(8, options.min_matches));
  if (matches.size() < needed) {
    return InputProblem{Refusal::kTooFewMatches,
                        std::to_string(matches.size()) + " matches, " + std::to_string(needed) + " needed"};
  }
  const auto inside = [&](const Eigen::Vector2d& uv_px) { return LiesWithinReach(uv_px, camera, options); };
  std::vector<double> displacement;
  displacement.reserve(matches.size());
  Eigen::AlignedBox2d extent;
  for (size_t i = 0; i < matches.size(); ++i) {
    if (!inside(matches[i].uv0_px) || !inside(matches[i].uv1_px)) {
      return InputProblem{Refusal::kBadInput,
                          "match " + std::to_string(i) + " is not finite or lies outside the image"};
    }
    displacement.push_back((matches[i].uv1_px - matches[i].uv0_px).squaredNorm());
    extent.extend(matches[i].uv0_px);
  }
  const auto middle = displacement.begin() + static_cast<ptrdiff_t>(displacement.size() / 2);
  std::nth_element(displacement.begin(), middle, displacement.end());
  if (std::sqrt(*middle) < options.min_displacement_px) {
    return InputProblem{Refusal::kNoMotion, "the median displacement is " +
                                                std::to_string(std::sqrt(*middle)) +
                                                " px: the frames show the same picture"};
  }
  if (extent.sizes().maxCoeff() < options.min_extent_share * DiagonalPx(camera)) {
    return InputProblem{Refusal::kTooFewCells, "all " + std::to_string(matches.size()) +
                                                   " matches lie within " +
                                                   std::to_string(std::lround(extent.sizes().maxCoeff())) +
                                                   " px: one cell determines no motion of the camera"};
  }
  return std::nullopt;
}

std::unique_ptr<StaticSelector> MakeSelector(const std::string& name, ModelKind kind) {
  if (name == "ransac") {
    RansacSelectorOptions options;
    options.sampling.kind = kind;
    return std::make_unique<RansacSelector>(options);
  }
  if (name == "arsac") {
    ArsacOptions options;
    options.sampling.kind = kind;
    return std::make_unique<Arsac>(options);
  }
  if (name == "dlrsac" || name == "dlrsac-paper") {
    DlrsacOptions options = name == "dlrsac" ? DlrsacOptions() : DlrsacOptions::Paper();
    if (name == "dlrsac") options.sampling.kind = kind;
    return std::make_unique<Dlrsac>(options);
  }
  throw InputError("unknown method '" + name + "': use dlrsac, dlrsac-paper, arsac or ransac");
}

}  // namespace dmslam
