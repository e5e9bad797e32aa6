#include "dmslam/evaluation/coverage.h"

#include <algorithm>

#include "dmslam/dataset/text_table.h"
#include "dmslam/util/check.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

// Stamps are copied from the image list; some programs round them to fewer decimals.
constexpr int64_t kSameFrameNs = 500'000;

bool HasFrame(std::span<const int64_t> frame_stamps_ns, int64_t stamp_ns) {
  const auto frame =
      std::lower_bound(frame_stamps_ns.begin(), frame_stamps_ns.end(), stamp_ns - kSameFrameNs);
  return frame != frame_stamps_ns.end() && *frame <= stamp_ns + kSameFrameNs;
}

}  // namespace

Coverage ComputeCoverage(std::span<const StampedPose> estimate, std::span<const int64_t> frame_stamps_ns) {
  Coverage coverage = ComputeCoverage(estimate, frame_stamps_ns.size());
  if (frame_stamps_ns.empty()) return coverage;
  size_t of_a_frame = 0;
  for (const StampedPose& pose : estimate) of_a_frame += HasFrame(frame_stamps_ns, pose.stamp_ns) ? 1 : 0;
  coverage.poses_of_no_frame = estimate.size() - of_a_frame;
  coverage.percent = 100.0 * static_cast<double>(of_a_frame) / static_cast<double>(frame_stamps_ns.size());
  if (!estimate.empty()) {
    coverage.time_to_first_pose_s =
        1e-9 * static_cast<double>(estimate.front().stamp_ns - frame_stamps_ns.front());
  }
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
