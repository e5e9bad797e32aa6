#include "dmslam/dataset/trajectory.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <fstream>
#include <functional>

#include "dmslam/dataset/text_table.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

constexpr size_t kColumns = 8;

double ParseValue(std::string_view field, const std::string& where) {
  double value = 0;
  if (field.starts_with('+')) field.remove_prefix(1);
  const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
  if (error != std::errc() || end != field.data() + field.size() || !std::isfinite(value)) {
    throw InputError(where + ": '" + std::string(field) + "' is not a finite number; write a decimal number");
  }
  return value;
}

StampedPose ParsePose(std::span<const std::string_view> fields, const std::string& where) {
  if (fields.size() != kColumns) {
    throw InputError(where + ": has " + std::to_string(fields.size()) +
                     " columns; a TUM trajectory has eight: stamp tx ty tz qx qy qz qw");
  }
  const std::optional<int64_t> stamp_ns = ParseStampNs(fields[0]);
  if (!stamp_ns) {
    throw InputError(where + ": '" + std::string(fields[0]) + "' is not a stamp; write decimal seconds");
  }
  std::array<double, 7> v{};
  for (size_t i = 0; i < v.size(); ++i) v[i] = ParseValue(fields[i + 1], where);
  const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
  if (!(rotation.norm() > 1e-6)) {
    throw InputError(where + ": the quaternion is zero; write qx qy qz qw of a rotation");
  }
  return {*stamp_ns, Rigid3d(rotation.normalized(), Eigen::Vector3d(v[0], v[1], v[2]))};
}

// Poses with strictly rising stamps; one whose stamp repeats the one before goes to `repeated` as an error
// and is left out where that returns.
std::vector<StampedPose> ReadPoses(const std::string& path,
                                   const std::function<void(const std::string& error)>& repeated) {
  std::vector<StampedPose> poses;
  ForEachRow(ReadTextFile(path), " \t,", [&](size_t line, std::span<const std::string_view> fields) {
    const StampedPose pose = ParsePose(fields, FileLine(path, line));
    if (!poses.empty() && pose.stamp_ns <= poses.back().stamp_ns) {
      const std::string error = FileLine(path, line) + ": stamp " + FormatStampNs(pose.stamp_ns);
      if (pose.stamp_ns < poses.back().stamp_ns) {
        throw InputError(error + " is earlier than the one before; sort the file by stamp");
      }
      return repeated(error + " repeats the one before; remove one of them");
    }
    poses.push_back(pose);
  });
  if (poses.empty()) throw InputError(path + ": holds no pose; is it a trajectory in TUM format?");
  return poses;
}

}  // namespace

std::vector<StampedPose> ReadTrajectory(const std::string& path) {
  return ReadPoses(path, [](const std::string& error) { throw InputError(error); });
}

GroundTruth ReadGroundTruth(const std::string& path) {
  std::vector<std::string> errors;
  GroundTruth truth;
  truth.poses = ReadPoses(path, [&](const std::string& error) { errors.push_back(error); });
  if (errors.size() * 1000 > truth.poses.size()) throw InputError(errors.front());
  for (const std::string& error : errors) truth.repeated.push_back(error.substr(0, error.find(": stamp ")));
  return truth;
}

std::string FormatPose(const StampedPose& pose) {
  const Eigen::Vector3d& t = pose.T_world_cam.translation;
  Eigen::Quaterniond q = pose.T_world_cam.rotation;
  if (q.w() < 0) q.coeffs() = -q.coeffs();
  char buffer[256];
  // Adding zero turns a negative zero into a positive one.
  std::snprintf(buffer, sizeof(buffer), " %.9f %.9f %.9f %.9f %.9f %.9f %.9f", t.x() + 0.0, t.y() + 0.0,
                t.z() + 0.0, q.x() + 0.0, q.y() + 0.0, q.z() + 0.0, q.w() + 0.0);
  return FormatStampNs(pose.stamp_ns) + buffer;
}

void WriteTrajectory(const std::string& path, std::span<const StampedPose> poses) {
  std::string text = "# timestamp tx ty tz qx qy qz qw\n";
  for (const StampedPose& pose : poses) text.append(FormatPose(pose)).append("\n");
  WriteFile(path, text);
}

}  // namespace dmslam
