#include "collector/map_ply.h"

#include <cstdio>
#include <sstream>
#include <vector>

#include "dmslam/dynamics/motion_belief.h"
#include "dmslam/util/output_file.h"

namespace dmslam {

void WriteMapPly(const std::string& path, const Map& map, std::optional<MapId> map_id) {
  std::ostringstream file;
  std::vector<const Landmark*> landmarks;
  for (const LandmarkId id : map.LandmarkIdsSorted()) {
    const Landmark* landmark = map.FindLandmark(id);
    if (landmark->map_id == map_id) landmarks.push_back(landmark);
  }
  std::vector<const Keyframe*> keyframes;
  for (const auto& [id, keyframe] : map.keyframes()) {
    if (keyframe.map_id == map_id) keyframes.push_back(&keyframe);
  }
  file << "ply\nformat ascii 1.0\ncomment map units; cameras are blue\nelement vertex "
       << landmarks.size() + keyframes.size()
       << "\nproperty double x\nproperty double y\nproperty double z\nproperty uchar red\nproperty uchar "
          "green\n"
          "property uchar blue\nend_header\n";
  char line[160];
  for (const Landmark* landmark : landmarks) {
    const bool moving = !IsStatic(landmark);
    std::snprintf(line, sizeof(line), "%.17g %.17g %.17g %d %d %d\n", landmark->p_world.x(),
                  landmark->p_world.y(), landmark->p_world.z(), moving ? 230 : 120, moving ? 40 : 120,
                  moving ? 40 : 120);
    file << line;
  }
  for (const Keyframe* keyframe : keyframes) {
    const Eigen::Vector3d center = keyframe->T_cam_world.Center();
    std::snprintf(line, sizeof(line), "%.17g %.17g %.17g 30 90 230\n", center.x(), center.y(), center.z());
    file << line;
  }
  WriteFile(path, file.str());
}

}  // namespace dmslam
