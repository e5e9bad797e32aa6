// Takes the player's place: publishes images as a camera would, in some 50 lines. A driver of your own
// does the same with its own images. Needs nothing of this project but message types and a camera file
// (docs/camera.md):
//
//   lcm-gen --cpp --cpp-hpath=types lcmtypes/dmslam_{camera_info,frame,end_of_sequence,sequence_done}_t.lcm
//   c++ -Itypes examples/frame_publisher/frame_publisher.cc -o frame_publisher -llcm -lyaml-cpp -lz
//   ./frame_publisher 'udpm://239.255.76.67:7670?ttl=0' camera.yaml images/*.png
#include <yaml-cpp/yaml.h>
#include <zlib.h>

#include <chrono>
#include <fstream>
#include <lcm/lcm-cpp.hpp>
#include <thread>
#include <vector>

#include "dmslam/camera_info_t.hpp"
#include "dmslam/end_of_sequence_t.hpp"
#include "dmslam/frame_t.hpp"
#include "dmslam/sequence_done_t.hpp"

using Done = dmslam::sequence_done_t;
static void OnDone(const lcm::ReceiveBuffer*, const std::string&, const Done*, bool* heard) { *heard = true; }

// Every message carries the CRC-32 of its own bytes, taken while the field is zero.
template <typename Message>
static void Publish(lcm::LCM& lcm, const std::string& channel, Message& message) {
  message.checksum = 0;
  std::vector<unsigned char> bytes(size_t(message.getEncodedSize()));
  message.encode(bytes.data(), 0, int(bytes.size()));
  message.checksum = int32_t(crc32_z(0, bytes.data(), bytes.size()));
  lcm.publish(channel, &message);
}

int main(int argc, char** argv) {
  if (argc < 4) return 2;
  using Clock = std::chrono::system_clock;
  lcm::LCM lcm(argv[1]);
  const YAML::Node file = YAML::LoadFile(argv[2]);
  dmslam::camera_info_t camera{};  // all that is not set is zero
  camera.session = 1;              // the same for all messages of a run
  camera.mode = dmslam::camera_info_t::MODE_REALTIME;
  camera.width_px = file["width"].as<int>(), camera.height_px = file["height"].as<int>();
  camera.fx_px = file["fx"].as<double>(), camera.fy_px = file["fy"].as<double>();
  camera.cx_px = file["cx"].as<double>(), camera.cy_px = file["cy"].as<double>();
  camera.fps = file["fps"].as<double>(30), camera.speed = 1, camera.sequence = "frame_publisher";
  const bool fisheye = file["model"].as<std::string>("") == "fisheye";
  const auto lens = file["distortion"].as<std::vector<double>>(std::vector<double>(5));
  camera.lens = fisheye ? dmslam::camera_info_t::LENS_FISHEYE : dmslam::camera_info_t::LENS_BROWN;
  camera.k1 = lens[0], camera.k2 = lens[1], (fisheye ? camera.k3 : camera.p1) = lens[2];
  (fisheye ? camera.k4 : camera.p2) = lens[3];
  if (!fisheye && lens.size() > 4) camera.k3 = lens[4];
  dmslam::frame_t frame{};
  frame.session = camera.session;
  auto due = Clock::now();
  for (int i = 3; i < argc; ++i) {
    std::this_thread::sleep_until(due += std::chrono::microseconds(int(1e6 / camera.fps)));
    if (i % 10 == 3) Publish(lcm, "DMSLAM_PLAYER_CAMERA_INFO", camera);  // several times a second
    std::ifstream image(argv[i], std::ios::binary);
    frame.data.assign(std::istreambuf_iterator<char>(image), {});
    frame.num_bytes = int(frame.data.size());
    frame.encoding = frame.data.at(0) == 0x89 ? int(frame.ENCODING_PNG) : int(frame.ENCODING_JPEG);
    frame.frame_index = i - 3;
    frame.stamp_ns = std::chrono::nanoseconds(due.time_since_epoch()).count();  // when it was taken
    frame.utime = frame.capture_us = frame.publish_us = frame.stamp_ns / 1000;
    Publish(lcm, "DMSLAM_PLAYER_FRAME", frame);
  }
  dmslam::end_of_sequence_t end{};  // repeated until the frontend says that it has heard it
  end.session = camera.session, end.frames_published = end.frames_listed = argc - 3;
  end.last_frame_index = frame.frame_index, end.last_stamp_ns = frame.stamp_ns;
  bool heard = false;
  lcm.subscribeFunction("DMSLAM_FRONTEND_SEQUENCE_DONE", OnDone, &heard);
  for (int i = 0; !heard && i < 100; ++i) {
    Publish(lcm, "DMSLAM_PLAYER_CAMERA_INFO", camera);
    Publish(lcm, "DMSLAM_PLAYER_END_OF_SEQUENCE", end);
    lcm.handleTimeout(200);
  }
  return heard ? 0 : 1;
}
