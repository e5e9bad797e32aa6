#pragma once

#include <optional>
#include <span>
#include <string>
#include <string_view>

namespace dmslam {

/// What Lu, Wang, Tang, Huang, Li, "DM-SLAM: Monocular SLAM in Dynamic Environments", Appl. Sci. 2020,
/// 10(12), 4252, report for one sequence: RMSE of the absolute trajectory error over ten runs [m]. Its other
/// figures are not recorded here, and are left out rather than guessed.
struct PaperFigures {
  double orb_slam2_ate_rmse_m;
  double dm_slam_ate_rmse_m;
};

/// The paper's Table 1: time of 2000 iterations [ms] on an i7.
inline constexpr double kPaperRansacMs = 34.6;
inline constexpr double kPaperArsacMs = 36.8;
inline constexpr double kPaperDlrsacMs = 40.1;

enum class SequenceGroup {
  kPaper,         // of the paper's own four
  kReal,          // other real images
  kStandIn,       // rendered, with the same kind of camera motion as one of the paper's four, and two actors
  kStandInStill,  // the same without actors
};

/// A sequence that the reproduction looks for.
struct SequenceInfo {
  std::string_view name;
  std::string_view folder;  // its folder's name
  std::string_view camera;  // camera file under config/
  SequenceGroup group;
  std::string_view like;    // kStandIn and kStandInStill: the paper's sequence it stands for
  std::string_view source;  // where it is to be had: its download page, or why there is none
  std::optional<PaperFigures> paper;
};

/// All sequences, in the order of the tables.
std::span<const SequenceInfo> KnownSequences();

/// The one of that name; throws InputError where there is none.
const SequenceInfo& FindSequence(std::string_view name);

}  // namespace dmslam
