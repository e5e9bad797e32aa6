#include "dmslam/wire/record_groups.h"

#include <iterator>
#include <vector>

namespace dmslam::wire {
namespace {

template <typename Item>
void Append(std::vector<Item> more, std::vector<Item>* all) {
  all->insert(all->end(), std::make_move_iterator(more.begin()), std::make_move_iterator(more.end()));
}

}  // namespace

void Append(MapDelta more, MapDelta* all) {
  Append(std::move(more.keyframes), &all->keyframes);
  Append(std::move(more.keyframe_poses), &all->keyframe_poses);
  Append(std::move(more.landmarks), &all->landmarks);
  Append(std::move(more.landmark_positions), &all->landmark_positions);
  Append(std::move(more.landmark_evidence), &all->landmark_evidence);
  Append(std::move(more.observations), &all->observations);
  Append(std::move(more.keyframe_tombstones), &all->keyframe_tombstones);
  Append(std::move(more.landmark_tombstones), &all->landmark_tombstones);
  Append(std::move(more.dropped_maps), &all->dropped_maps);
  all->version = more.version;
  all->progress = more.progress;
}

void Append(LoopAnswer more, LoopAnswer* all) {
  Append(std::move(more.corrections), &all->corrections);
  Append(std::move(more.fusions), &all->fusions);
  Append(std::move(more.landmark_offsets), &all->landmark_offsets);
}

}  // namespace dmslam::wire
