#pragma once

namespace dmslam {

/// 95 % of squared errors, in units of their variance, lie below these where errors are normal.
inline constexpr double kChiSquared1Dof = 3.841;
inline constexpr double kChiSquared2Dof = 5.991;
/// The square root of the second: an error in sigmas.
inline constexpr double kChi2Dof = 2.447651936;
/// 99 % of those with two degrees of freedom lie below this.
inline constexpr double kChiSquared2Dof99 = 9.210;

/// The first one as the segmentation and the epipolar search round it...
inline constexpr double kRoundedChiSquared1Dof = 3.84;
/// ...and what such a bound is multiplied by where there are two residuals instead of one.
inline constexpr double kTwoResidualsForOne = 5.99 / kRoundedChiSquared1Dof;

}  // namespace dmslam
