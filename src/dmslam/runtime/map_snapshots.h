#pragma once

#include <deque>

#include "dmslam/map/map.h"
#include "dmslam/messaging/stream_writer.h"

namespace dmslam {

/// Cuts snapshots of a map for readers that come late: the local map first.
class MapSnapshots : public SnapshotSource {
 public:
  explicit MapSnapshots(const Map* map) : map_(map) {}

  void BeginSnapshot(int64_t cut) override;
  Piece NextPiece() override;

 private:
  const Map* map_;
  std::deque<MapDelta> parts_;
};

}  // namespace dmslam
