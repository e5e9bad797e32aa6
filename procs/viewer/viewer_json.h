#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/wire/frontend_messages.h"
#include "dmslam/wire/player_messages.h"
#include "dmslam/wire/status.h"
#include "viewer/process_board.h"
#include "viewer/viewer_core.h"

namespace dmslam {

/// One of several cameras.
struct CameraView {
  const CameraInfo* info = nullptr;  ///< null: not known yet
  std::optional<MapId> map_id;       ///< in which it was last
  bool ended = false;                ///< its sequence is over
};

/// What the page's header, tables and charts are made of.
struct StatusView {
  int64_t now_ns = 0, wall_us = 0;
  uint32_t session = 0;
  const CameraInfo* camera = nullptr;  ///< null: not known yet
  const FrontendStatus* frontend = nullptr;
  const MapperStatus* mapper = nullptr;
  const LoopcloserStatus* loopcloser = nullptr;
  const ProcessBoard* board = nullptr;
  const TruthAlignment* alignment = nullptr;  ///< null: none
  Eigen::Vector3d up{0, -1, 0};
  bool ended = false;
  int64_t loops = 0;
  std::optional<MapId> map_id;        ///< that is shown; none: there is none
  const MapLayout* layout = nullptr;  ///< null: there is no map
  std::vector<CameraView> cameras;    ///< by number
  size_t keyframes = 0, landmarks = 0, moving = 0;
  uint64_t map_version = 0;
  uint32_t resets = 0;
  size_t browsers = 0;
  int64_t skipped = 0;
};

/// What a process does, in a word.
std::string StateWord(PlayerStatus::State state);
std::string StateWord(TrackingState state);
std::string StateWord(MapperStatus::State state);
std::string StateWord(LoopcloserStatus::State state);

/// "map 2", or "map 2 of camera 1": each camera numbers the maps that it begins.
std::string NameOf(MapId map_id);
/// "maps 1 and 2 are joined".
std::string Describe(const JoinedMaps& joined);

std::string ToJson(const StatusView& view);
/// `drawn`: the pose where its map is drawn; none: it has none, or it is not known where that is.
/// `arrangement`: the scene's, among which that place is.
std::string PoseJson(const PoseView& view, const std::optional<Rigid3d>& drawn, uint32_t arrangement);
/// Features that were matched: "data" is base64 of five bytes each, u and v [px * 16] as little-endian 16 bit
/// words, kind.
std::string FeaturesJson(const FeatureView& view, int width_px, int height_px);

std::string Base64(const std::vector<uint8_t>& bytes);

}  // namespace dmslam
