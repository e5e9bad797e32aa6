// Uses rooms and message types of an installed dmslam: where a camera sees a point, how far a trajectory is
// from another one, and a camera message there and back.
#include <cstdio>
#include <dmslam/pose_t.hpp>
#include <exception>

#include "dmslam/camera/camera.h"
#include "dmslam/dataset/trajectory.h"
#include "dmslam/evaluation/ate.h"
#include "dmslam/util/version.h"
#include "dmslam/wire/codec.h"

namespace {

int Run(const char* camera_file, const char* truth_file, const char* estimate_file) {
  const dmslam::Camera camera = dmslam::LoadCamera(camera_file);
  const auto uv_px = camera.Project({0.1, 0.2, 2.0});
  std::printf("dmslam %s; the point is seen at (%.2f, %.2f)\n", dmslam::kVersion, uv_px->x(), uv_px->y());

  const auto truth = dmslam::ReadTrajectory(truth_file);
  const auto ate = dmslam::EvaluateAte(truth, dmslam::ReadTrajectory(estimate_file));
  if (!ate.usable()) return std::printf("no error: %s\n", ate.reason.c_str()), 1;
  std::printf("%zu poses, ATE %.4f\n", ate.pairs.size(), ate.rmse());

  dmslam::CameraInfo info;
  info.session = 7;
  info.camera = camera;
  const auto bytes = dmslam::wire::Encode(info);
  const auto back = dmslam::wire::Decode<dmslam::CameraInfo>(bytes);
  std::printf("%zu bytes, session %u; %s is %d bytes\n", bytes.size(), back ? back->session : 0,
              dmslam::pose_t::getTypeName(), dmslam::pose_t{}.getEncodedSize());
  return back ? 0 : 1;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 4) {
    std::fprintf(stderr, "Usage: outside_project CAMERA.yaml GROUND_TRUTH.txt ESTIMATE.txt\n");
    return 2;
  }
  try {
    return Run(argv[1], argv[2], argv[3]);
  } catch (const std::exception& error) {
    std::fprintf(stderr, "outside_project: %s\n", error.what());
    return 1;
  }
}
