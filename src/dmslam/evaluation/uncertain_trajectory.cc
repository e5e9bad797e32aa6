#include "dmslam/evaluation/uncertain_trajectory.h"

#include <array>
#include <charconv>
#include <cmath>
#include <cstdio>

#include "dmslam/dataset/text_table.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

constexpr size_t kPoseNumbers = 7, kUpper = 21;
// stamp frame state map | pose | depth | reference frame, pose, scale | covariance | step: from, covariance
constexpr size_t kColumns = 4 + kPoseNumbers + 1 + 1 + kPoseNumbers + 1 + kUpper + 1 + kUpper;

void Append(double value, std::string* line) {
  char text[40];
  std::snprintf(text, sizeof(text), ",%.10g", value);
  *line += text;
}

void AppendPose(const Rigid3d& T, std::string* line) {
  for (const double value : {T.translation.x(), T.translation.y(), T.translation.z()}) Append(value, line);
  for (const double value : {T.rotation.x(), T.rotation.y(), T.rotation.z(), T.rotation.w()})
    Append(value, line);
}

void AppendCovariance(const std::optional<Matrix6d>& covariance, std::string* line) {
  for (size_t i = 0; i < kUpper; ++i) Append(covariance ? UpperTriangle(*covariance)[i] : std::nan(""), line);
}

std::string Names() {
  std::string names =
      "# stamp,frame,state,map,x,y,z,qx,qy,qz,qw,depth,reference_frame,"
      "x_cam_reference,y_cam_reference,z_cam_reference,qx_cam_reference,qy_cam_reference,qz_cam_reference,"
      "qw_cam_reference,reference_scale";
  const auto add = [&names](const char* prefix) {
    constexpr std::array kNames = {"x", "y", "z", "rx", "ry", "rz"};
    for (size_t i = 0; i < kNames.size(); ++i) {
      for (size_t j = i; j < kNames.size(); ++j)
        names += std::string(",") + prefix + kNames[i] + "_" + kNames[j];
    }
  };
  add("cov_");
  names += ",step_from";
  add("step_");
  return names + "\n";
}

std::string Line(const ToldPose& told) {
  std::string line = FormatStampNs(told.pose.stamp_ns) + "," + std::to_string(told.frame) + "," +
                     std::to_string(told.state) + "," + std::to_string(told.map);
  AppendPose(told.pose.T_world_cam, &line);
  Append(told.depth, &line);
  line += "," + std::to_string(told.reference_frame);
  AppendPose(told.T_cam_reference, &line);
  Append(told.reference_scale, &line);
  AppendCovariance(told.covariance, &line);
  line += "," + (told.step_from ? std::to_string(*told.step_from) : "nan");
  AppendCovariance(told.step_covariance, &line);
  return line + "\n";
}

/// Takes the numbers of a line one after another.
class Fields {
 public:
  Fields(std::span<const std::string_view> fields, std::string where)
      : fields_(fields), where_(std::move(where)) {}

  std::string_view Text() { return fields_[at_++]; }
  double Number() {
    const std::string_view field = Text();
    double value = 0;
    const auto [end, error] = std::from_chars(field.data(), field.data() + field.size(), value);
    if (error != std::errc() || end != field.data() + field.size())
      throw InputError(where_ + ": '" + std::string(field) + "' is not a number");
    return value;
  }
  uint32_t Count() {
    const double value = Number();
    if (!(value >= 0 && value <= 4294967295.0)) throw InputError(where_ + ": a number is out of range");
    return static_cast<uint32_t>(value);
  }
  std::optional<uint32_t> OptionalCount() {
    if (fields_[at_] != "nan") return Count();
    ++at_;
    return std::nullopt;
  }
  Rigid3d Pose() {
    std::array<double, kPoseNumbers> v{};
    for (double& value : v) value = Number();
    const Eigen::Quaterniond rotation(v[6], v[3], v[4], v[5]);
    if (!(rotation.norm() > 1e-6)) throw InputError(where_ + ": the quaternion is zero");
    return {rotation.normalized(), Eigen::Vector3d(v[0], v[1], v[2])};
  }
  std::optional<Matrix6d> Covariance() {
    std::array<double, kUpper> upper{};
    for (double& value : upper) value = Number();
    const Matrix6d covariance = FromUpperTriangle(upper);
    return covariance.allFinite() ? std::optional(covariance) : std::nullopt;
  }

 private:
  std::span<const std::string_view> fields_;
  std::string where_;
  size_t at_ = 0;
};

ToldPose Parse(std::span<const std::string_view> columns, const std::string& where) {
  if (columns.size() != kColumns)
    throw InputError(where + ": has " + std::to_string(columns.size()) + " columns and not " +
                     std::to_string(kColumns) + "; is it a poses_online.csv?");
  Fields fields(columns, where);
  ToldPose told;
  const std::optional<int64_t> stamp_ns = ParseStampNs(fields.Text());
  if (!stamp_ns) throw InputError(where + ": the stamp is not decimal seconds");
  told.pose.stamp_ns = *stamp_ns;
  told.frame = fields.Count();
  told.state = static_cast<int>(fields.Count());
  told.map = fields.Count();
  told.pose.T_world_cam = fields.Pose();
  told.depth = fields.Number();
  told.reference_frame = fields.Count();
  told.T_cam_reference = fields.Pose();
  told.reference_scale = fields.Number();
  told.covariance = fields.Covariance();
  told.step_from = fields.OptionalCount();
  told.step_covariance = fields.Covariance();
  return told;
}

}  // namespace

std::optional<UncertainPose> ToldPose::InMap() const {
  if (!covariance) return std::nullopt;
  const Eigen::Matrix3d R_world_reference =
      (pose.T_world_cam.rotation * T_cam_reference.rotation).toRotationMatrix();
  Matrix6d turn = Matrix6d::Zero();
  turn.topLeftCorner<3, 3>() = turn.bottomRightCorner<3, 3>() = R_world_reference;
  return UncertainPose{pose.T_world_cam, turn * *covariance * turn.transpose()};
}

void WriteToldPoses(const std::string& path, std::span<const ToldPose> poses) {
  std::string text = Names();
  for (const ToldPose& told : poses) text += Line(told);
  WriteFile(path, text);
}

std::vector<ToldPose> ReadToldPoses(const std::string& path) {
  std::vector<ToldPose> poses;
  ForEachRow(ReadTextFile(path), ",", [&](size_t line, std::span<const std::string_view> fields) {
    poses.push_back(Parse(fields, FileLine(path, line)));
  });
  if (poses.empty()) throw InputError(path + ": holds no pose");
  return poses;
}

}  // namespace dmslam
