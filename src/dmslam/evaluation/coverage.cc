#include "dmslam/evaluation/coverage.h"

#include <algorithm>

#include "dmslam/dataset/text_table.h"
#include "dmslam/util/check.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

// Stamps are copied from the image list; some programs round them to fewer decimals.
constexpr int64_t kSameFrameNs = 500'000;

// The index of the frame that a pose belongs to.
std::optional<size_t> FrameOf(std::span<const int64_t> frame_stamps_ns, int64_t stamp_ns) {
  const auto frame =
      std::lower_bound(frame_stamps_ns.begin(), frame_stamps_ns.end(), stamp_ns - kSameFrameNs);
  if (frame == frame_stamps_ns.end() || *frame > stamp_ns + kSameFrameNs) return std::nullopt;
  return static_cast<size_t>(frame - frame_stamps_ns.begin());
}

}  // namespace

Coverage ComputeCoverage(std::span<const StampedPose> estimate, std::span<const int64_t> frame_stamps_ns) {
  Coverage coverage = ComputeCoverage(estimate, frame_stamps_ns.size());
  if (frame_stamps_ns.empty()) return coverage;
  std::vector<bool> has_pose(frame_stamps_ns.size());
  for (const StampedPose& pose : estimate) {
    if (const auto frame = FrameOf(frame_stamps_ns, pose.stamp_ns)) {
      has_pose[*frame] = true;
    } else {
      ++coverage.poses_of_no_frame;
    }
  }
  const auto covered = std::count(has_pose.begin(), has_pose.end(), true);
  coverage.percent = 100.0 * static_cast<double>(covered) / static_cast<double>(frame_stamps_ns.size());
  if (covered == 0) return coverage;
  const auto first = std::find(has_pose.begin(), has_pose.end(), true) - has_pose.begin();
  coverage.time_to_first_pose_s =
      1e-9 * static_cast<double>(frame_stamps_ns[static_cast<size_t>(first)] - frame_stamps_ns.front());
  return coverage;
}

Coverage ComputeCoverage(std::span<const StampedPose> estimate, size_t frames) {
  Coverage coverage;
  coverage.poses = estimate.size();
  if (frames == 0) return coverage;
  coverage.frames = frames;
  coverage.percent = 100.0 * static_cast<double>(estimate.size()) / static_cast<double>(frames);
  return coverage;
}

std::vector<int64_t> ReadFrameStamps(const std::string& path) {
  std::vector<int64_t> stamps_ns;
  ForEachRow(ReadTextFile(path), " \t", [&](size_t line, std::span<const std::string_view> fields) {
    const std::string where = FileLine(path, line);
    if (fields.size() != 2) {
      throw InputError(where + ": has " + std::to_string(fields.size()) +
                       " columns; an image list has two: stamp file");
    }
    const std::optional<int64_t> stamp_ns = ParseStampNs(fields[0]);
    if (!stamp_ns) {
      throw InputError(where + ": '" + std::string(fields[0]) + "' is not a stamp; write decimal seconds");
    }
    if (!stamps_ns.empty() && *stamp_ns <= stamps_ns.back()) {
      throw InputError(where + ": stamp " + std::string(fields[0]) +
                       " is not later than the one before; sort the list");
    }
    stamps_ns.push_back(*stamp_ns);
  });
  if (stamps_ns.empty()) throw InputError(path + ": lists no frame; is it an image list as rgb.txt?");
  return stamps_ns;
}

}  // namespace dmslam
