#include "dmslam/wire/record_groups.h"

#include <algorithm>
#include <iterator>
#include <tuple>

namespace dmslam::wire {
namespace {

/// What items take at most when they are encoded, and a record without any [bytes].
constexpr size_t kRecordBytes = 512, kPoseBytes = 72, kMoveBytes = 72, kLandmarkBytes = 124,
                 kPositionBytes = 32, kEvidenceBytes = 32, kObservationBytes = 22, kDeadKeyframeBytes = 88,
                 kDeadLandmarkBytes = 16, kMapIdBytes = 4, kCorrectionBytes = 72, kFusionBytes = 16,
                 kOffsetBytes = 32;

size_t BytesOf(const KeyframeState& keyframe) {
  const size_t bytes = 128 + 8 * keyframe.loop_edges.size();
  if (keyframe.features == nullptr) return bytes;
  const FeatureSet& features = *keyframe.features;
  return bytes + 38 * features.size() + 4 * features.depths_m.size() + 4 * features.depth_sigmas_m.size() +
         4 * features.sigmas_px.size();
}

auto Each(size_t bytes) {
  return [bytes](const auto&) { return bytes; };
}

/// Calls `visit(list, bytes of an item)` for each list of a change.
void ForEachList(const MapDelta*, const auto& visit) {
  visit(&MapDelta::keyframes, [](const KeyframeState& keyframe) { return BytesOf(keyframe); });
  visit(&MapDelta::keyframe_poses, Each(kPoseBytes));
  visit(&MapDelta::reference_moves, Each(kMoveBytes));
  visit(&MapDelta::landmarks, Each(kLandmarkBytes));
  visit(&MapDelta::landmark_positions, Each(kPositionBytes));
  visit(&MapDelta::landmark_evidence, Each(kEvidenceBytes));
  visit(&MapDelta::observations, Each(kObservationBytes));
  visit(&MapDelta::keyframe_tombstones, Each(kDeadKeyframeBytes));
  visit(&MapDelta::landmark_tombstones, Each(kDeadLandmarkBytes));
  visit(&MapDelta::dropped_maps, Each(kMapIdBytes));
}

void ForEachList(const LoopAnswer*, const auto& visit) {
  visit(&LoopAnswer::corrections, Each(kCorrectionBytes));
  visit(&LoopAnswer::fusions, Each(kFusionBytes));
  visit(&LoopAnswer::landmark_offsets, Each(kOffsetBytes));
}

/// All of a change but its lists and its note.
MapDelta HeaderOf(const MapDelta& change) {
  MapDelta header;
  header.event = change.event;
  header.about = change.about;
  header.map_id = change.map_id;
  header.version = change.version;
  header.correction_id = change.correction_id;
  header.request = change.request;
  header.stamp_ns = change.stamp_ns;
  header.progress = change.progress;
  return header;
}

LoopAnswer HeaderOf(const LoopAnswer& answer) {
  LoopAnswer header;
  header.keyframe = answer.keyframe;
  header.base_version = answer.base_version;
  header.correction_id = answer.correction_id;
  header.kind = answer.kind;
  header.seen_from = answer.seen_from;
  header.matched = answer.matched;
  header.stamp_ns = answer.stamp_ns;
  return header;
}

uint64_t GroupIdOf(const MapDelta& change) { return std::max<uint64_t>(change.version, 1); }
uint64_t GroupIdOf(const LoopAnswer& answer) { return answer.correction_id.value_or(answer.keyframe.value); }

template <typename Message>
size_t BytesOfLists(const Message& change) {
  size_t bytes = 0;
  ForEachList(&change, [&](auto list, const auto& bytes_of) {
    for (const auto& item : change.*list) bytes += bytes_of(item);
  });
  return bytes;
}

template <typename Message>
std::vector<Message> SplitChange(Message change, size_t max_bytes) {
  const size_t first_bytes = kRecordBytes + change.note.size();
  if (first_bytes + BytesOfLists(change) <= max_bytes) return {std::move(change)};
  std::vector<Message> parts = {HeaderOf(change)};
  parts[0].note = std::move(change.note);
  size_t bytes = first_bytes;
  bool empty = true;
  ForEachList(&change, [&](auto list, const auto& bytes_of) {
    for (auto& item : change.*list) {
      const size_t more = bytes_of(item);
      if (bytes + more > max_bytes && !empty) {
        parts.push_back(HeaderOf(change));
        bytes = kRecordBytes;
      }
      (parts.back().*list).push_back(std::move(item));
      bytes += more;
      empty = false;
    }
    change.*list = {};  // it is not held twice
  });
  if (parts.size() == 1) return parts;
  for (size_t i = 0; i < parts.size(); ++i)
    parts[i].group = {GroupIdOf(change), static_cast<uint32_t>(i), static_cast<uint32_t>(parts.size())};
  return parts;
}

template <typename Message>
void AppendLists(Message more, Message* all) {
  ForEachList(all, [&](auto list, const auto&) {
    auto& from = more.*list;
    auto& to = all->*list;
    to.insert(to.end(), std::make_move_iterator(from.begin()), std::make_move_iterator(from.end()));
  });
}

}  // namespace

std::vector<MapDelta> Split(MapDelta change, size_t max_bytes) {
  return SplitChange(std::move(change), max_bytes);
}

std::vector<LoopAnswer> Split(LoopAnswer change, size_t max_bytes) {
  return SplitChange(std::move(change), max_bytes);
}

void Append(MapDelta more, MapDelta* all) { AppendLists(std::move(more), all); }

void Append(LoopAnswer more, LoopAnswer* all) { AppendLists(std::move(more), all); }

bool TellOfOneChange(const MapDelta& a, const MapDelta& b) {
  const auto header = [](const MapDelta& change) {
    return std::tie(change.event, change.about, change.map_id, change.version, change.correction_id,
                    change.request, change.stamp_ns, change.progress);
  };
  return header(a) == header(b);
}

bool TellOfOneChange(const LoopAnswer& a, const LoopAnswer& b) {
  const auto header = [](const LoopAnswer& answer) {
    return std::tie(answer.keyframe, answer.base_version, answer.correction_id, answer.kind, answer.seen_from,
                    answer.matched, answer.stamp_ns);
  };
  return header(a) == header(b);
}

}  // namespace dmslam::wire
