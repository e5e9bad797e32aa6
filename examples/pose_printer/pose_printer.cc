// Prints where the camera is, frame by frame, as the frontend says it. Needs nothing of this project but the
// message types that lcm-gen makes of lcmtypes/dmslam_pose_t.lcm:
//
//   lcm-gen --cpp --cpp-hpath=types lcmtypes/dmslam_pose_t.lcm
//   c++ -std=c++17 -Itypes examples/pose_printer/pose_printer.cc -llcm -o pose_printer
//   ./pose_printer "udpm://239.255.76.67:7670?ttl=0"
//
// The bus may also be a log, played as fast as possible: "file://run.lcmlog?speed=0".

#include <array>
#include <cstdio>
#include <lcm/lcm-cpp.hpp>
#include <string>

#include "dmslam/pose_t.hpp"

namespace {

// By their numbers, as dmslam_frame_pose_t.lcm names them.
const std::array kStates = {"no map yet",   "waiting for a map", "trying a map",
                            "tracking",     "uncertain",         "lost",
                            "placed later", "rotation only",     "too few landmarks"};

const char* StateName(int state) {
  return state >= 0 && state < static_cast<int>(kStates.size()) ? kStates[static_cast<size_t>(state)]
                                                                : "unknown state";
}

class PosePrinter {
 public:
  // Called by LCM for each message whose type is pose_t; others never get here. An exception must not leave a
  // handler.
  void OnPose(const lcm::ReceiveBuffer*, const std::string&, const dmslam::pose_t* pose) {
    if (session_ != pose->session) {
      session_ = pose->session;
      std::printf("# session %lld\n", static_cast<long long>(session_));
    }
    std::printf("%lld.%09lld frame %d: ", static_cast<long long>(pose->stamp_ns / 1000000000),
                static_cast<long long>(pose->stamp_ns % 1000000000), pose->frame_index);
    if (!pose->has_pose) {
      std::printf("%s\n", StateName(pose->state));
      return;
    }
    std::printf("at (%.4f, %.4f, %.4f) of map %d, %s by %d features, %.0f %% of the image moves\n", pose->x,
                pose->y, pose->z, pose->map_id, StateName(pose->state), pose->inliers,
                100 * pose->moving_share);
    std::fflush(stdout);
  }

 private:
  long long session_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  lcm::LCM lcm(argc > 1 ? argv[1] : "udpm://239.255.76.67:7670?ttl=0");
  if (!lcm.good()) {
    std::fprintf(stderr, "pose_printer: this bus cannot be used; give its URL as the first argument\n");
    return 1;
  }
  PosePrinter printer;
  lcm.subscribe("DMSLAM_FRONTEND_POSE", &PosePrinter::OnPose, &printer);
  while (lcm.handle() == 0) {
  }
  return 0;  // a log ends; a network does not
}
