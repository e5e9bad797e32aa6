#include "dmslam/runtime/map_snapshots.h"

#include <iterator>
#include <optional>
#include <vector>

#include "dmslam/map/snapshot.h"
#include "dmslam/wire/codec.h"

namespace dmslam {

bool MapSnapshots::Ready() {
  wanted_ = may_read_ && !may_read_();
  return !wanted_;
}

void MapSnapshots::BeginSnapshot(int64_t) {
  std::optional<KeyframeId> newest;
  if (!map_->keyframes().empty()) newest = map_->keyframes().rbegin()->first;
  std::vector<MapDelta> parts = CutSnapshot(*map_, newest, kSnapshotPieceBytes);
  parts_.assign(std::make_move_iterator(parts.begin()), std::make_move_iterator(parts.end()));
}

SnapshotSource::Piece MapSnapshots::NextPiece() {
  Piece piece;
  piece.channel = channels::kMap;
  piece.message = wire::Encode(parts_.front());
  parts_.pop_front();
  piece.last = parts_.empty();
  return piece;
}

}  // namespace dmslam
