#pragma once

#include <deque>
#include <functional>
#include <utility>

#include "dmslam/map/map.h"
#include "dmslam/messaging/stream_writer.h"

namespace dmslam {

/// Cuts snapshots of a map for readers that come late: the local map first.
class MapSnapshots : public SnapshotSource {
 public:
  /// `may_read`: whether the map may be read now; empty: always.
  explicit MapSnapshots(const Map* map, std::function<bool()> may_read = {})
      : map_(map), may_read_(std::move(may_read)) {}

  bool Ready() override;
  /// Whether somebody waits for a snapshot until the map may be read.
  bool wanted() const { return wanted_; }
  void BeginSnapshot(int64_t cut) override;
  Piece NextPiece() override;

 private:
  const Map* map_;
  std::function<bool()> may_read_;
  bool wanted_ = false;
  std::deque<MapDelta> parts_;
};

}  // namespace dmslam
