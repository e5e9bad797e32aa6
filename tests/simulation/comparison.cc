#include "comparison.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <iterator>
#include <set>
#include <vector>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/evaluation/ate.h"

namespace dmslam::simulation {
namespace {

/// Of the text of a trajectory's file; none where it has no pose.
std::vector<StampedPose> Poses(const std::string& text, const std::string& folder) {
  if (std::ranges::count(text, '\n') < 2) return {};
  const std::string path = folder + "/poses.txt";
  std::ofstream(path) << text;
  return ReadTrajectory(path);
}

std::set<int64_t> Stamps(const std::vector<StampedPose>& poses) {
  std::set<int64_t> stamps;
  for (const StampedPose& pose : poses) stamps.insert(pose.stamp_ns);
  return stamps;
}

bool ToldIsPlaced(const Outcome& outcome, const std::string& folder) {
  return std::ranges::includes(Stamps(Poses(outcome.trajectory, folder)),
                               Stamps(Poses(outcome.online, folder)));
}

}  // namespace

double Number(const Outcome& outcome, const std::string& key) {
  const size_t at = outcome.summary.find("\"" + key + "\":");
  return at == std::string::npos ? -1 : std::atof(outcome.summary.c_str() + at + key.size() + 3);
}

Distance Measure(const Outcome& outcome, const Outcome& other, const std::string& folder) {
  Distance distance;
  const auto poses = Poses(outcome.trajectory, folder), others = Poses(other.trajectory, folder);
  distance.placed = static_cast<int64_t>(poses.size());
  distance.tracked = static_cast<int64_t>(Poses(outcome.online, folder).size());
  if (poses.empty() || others.empty()) return distance;
  const AteReport report = EvaluateAte(others, poses);
  if (report.usable()) distance.rmse = report.rmse();
  std::vector<int64_t> differing;
  std::ranges::set_symmetric_difference(Stamps(Poses(outcome.keyframes, folder)),
                                        Stamps(Poses(other.keyframes, folder)),
                                        std::back_inserter(differing));
  distance.other_keyframes = static_cast<int64_t>(differing.size());
  return distance;
}

std::string Difference(const Outcome& outcome, const Outcome& undisturbed) {
  if (!outcome.failure.empty()) return outcome.failure;
  std::string difference;
  if (outcome.trajectory != undisturbed.trajectory) difference += " another trajectory,";
  if (outcome.online != undisturbed.online) difference += " other poses while it went on,";
  if (outcome.keyframes != undisturbed.keyframes) difference += " other keyframes,";
  if (outcome.map != undisturbed.map) difference += " another map,";
  return difference;
}

bool NamesLosses(const Outcome& outcome) {
  return Number(outcome, "records_lost") > 0 || Number(outcome, "keyframes_lost_with_frontend") > 0 ||
         Number(outcome, "keyframes_lost_in_crash") > 0 || Number(outcome, "resumed") > 0;
}

std::string Unnamed(const Outcome& outcome, const std::string& folder) {
  if (!outcome.failure.empty()) return outcome.failure;
  std::string loss;
  if (Number(outcome, "keyframes_missing") != 0) loss += " keyframes are missing,";
  if (!ToldIsPlaced(outcome, folder)) loss += " a pose that was told is missing,";
  return loss;
}

std::string LossByResuming(const Outcome& outcome, const std::string& folder) {
  std::string loss;
  int64_t resumed = 0, behind = 0;
  const std::set<int64_t> placed = Stamps(Poses(outcome.trajectory, folder));
  for (const Outcome::Resumed& time : outcome.resumed) {
    if (time.anew) resumed = behind = 0, loss.clear();
    if (time.anew) continue;
    resumed += !time.complete;
    behind += std::ranges::count_if(time.proposed, [&](uint32_t frame) {
      return !time.newest_keyframe || frame > *time.newest_keyframe;
    });
    const auto is_gone = [&](int64_t stamp_ns) { return !placed.contains(stamp_ns); };
    if (const auto gone = std::ranges::count_if(time.written, is_gone); gone > 0)
      loss += " of poses that were written are missing: " + std::to_string(gone) + ",";
  }
  if (Number(outcome, "resumed") < static_cast<double>(resumed))
    loss += " it does not say that it was resumed,";
  const bool only_so = Number(outcome, "resumed") == static_cast<double>(resumed);
  if (only_so && Number(outcome, "keyframes_lost_in_crash") > static_cast<double>(behind))
    loss += " keyframes of the checkpoint are lost,";
  return loss;
}

std::string Loss(const Outcome& outcome, const Outcome& undisturbed, const Allowance& allowed,
                 const std::string& folder) {
  if (!outcome.failure.empty()) return outcome.failure;
  std::string loss;
  const auto more = [&](const char* key, int64_t most) {
    return Number(outcome, key) < 0 || Number(outcome, key) > static_cast<double>(most);
  };
  if (more("keyframes_missing", allowed.keyframes_missing)) loss += " keyframes are missing,";
  if (more("records_lost", allowed.records_lost)) loss += " records are lost,";
  if (more("resumed", allowed.resumed)) loss += " it began again from a checkpoint,";
  const Distance distance = Measure(outcome, undisturbed, folder);
  if (distance.rmse > allowed.most_apart) loss += " poses are off by " + std::to_string(distance.rmse) + ",";
  const size_t tracked = Poses(undisturbed.online, folder).size();
  if (distance.tracked + allowed.frames_lost < static_cast<int64_t>(tracked))
    loss += " only " + std::to_string(distance.tracked) + " frames were tracked,";
  if (!ToldIsPlaced(outcome, folder)) loss += " a pose that was told is missing,";
  return loss;
}

}  // namespace dmslam::simulation
