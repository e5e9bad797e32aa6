// The whole SLAM over a folder of images, in one program: no LCM, no other processes.
//   slam_folder SEQUENCE CAMERA.yaml VOCABULARY.dmv TRAJECTORY.txt [KEY=VALUE ...]
// SEQUENCE is a folder of the TUM RGB-D benchmark (rgb.txt), of EuRoC, of numbered images, or a video. The
// trajectory is written in TUM format, world from camera, in units of the map.
#include <cstdio>
#include <exception>
#include <memory>
#include <string>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/dataset/frame_source.h"
#include "dmslam/dataset/trajectory.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/settings/settings.h"
#include "dmslam/settings/slam_setup.h"
#include "dmslam/slam/slam.h"

namespace {

int Run(const std::vector<std::string>& arguments) {
  const dmslam::Camera camera = dmslam::LoadCamera(arguments[1]);
  const auto vocabulary = std::make_shared<const dmslam::Vocabulary>(dmslam::LoadOrbVocabulary(arguments[2]));
  const dmslam::Settings settings = dmslam::LoadSettings("", {arguments.begin() + 4, arguments.end()});
  dmslam::Slam slam(dmslam::SlamSetup(settings, camera, vocabulary));

  const std::unique_ptr<dmslam::FrameSource> frames = dmslam::OpenFrameSource(arguments[0]);
  dmslam::GrayDecoder decoder;
  dmslam::GrayImage image;
  size_t tracked = 0;
  for (size_t i = 0; i < frames->size(); ++i) {
    const dmslam::EncodedImage file = frames->Read(i);
    decoder.Decode(file.encoding, file.width, file.height, file.bytes, frames->Name(i), image);
    if (image.width != camera.width_px || image.height != camera.height_px) {
      std::fprintf(stderr, "%s: not of the camera's size\n", frames->Name(i).c_str());
      return 2;
    }
    const dmslam::FramePose pose = slam.Process(frames->FrameIndex(i), frames->StampNs(i),
                                                {image.data.data(), image.width, image.height, image.width});
    if (pose.HasPose()) ++tracked;
  }

  const auto trajectories = slam.Finish();
  std::printf("%zu of %zu frames tracked as they came, %zu placed in the end; %zu keyframes, %zu landmarks\n",
              tracked, frames->size(), trajectories.final.size(), slam.map().keyframes().size(),
              slam.map().num_landmarks());
  if (trajectories.final.empty()) return 6;
  dmslam::WriteTrajectory(arguments[3], trajectories.final);
  return 0;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc < 5) {
    std::fprintf(stderr,
                 "Usage: slam_folder SEQUENCE CAMERA.yaml VOCABULARY.dmv TRAJECTORY.txt [KEY=VALUE ...]\n");
    return 2;
  }
  try {
    return Run({argv + 1, argv + argc});
  } catch (const std::exception& error) {
    std::fprintf(stderr, "slam_folder: %s\n", error.what());
    return 1;
  }
}
