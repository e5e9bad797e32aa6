#include "dmslam/features/frame_features.h"

namespace dmslam {
namespace {

FeatureSet CopyInto(std::pmr::memory_resource* memory, const FeatureSet& set) {
  return {{set.keypoints, memory},
          {set.descriptors, memory},
          {set.depths_m, memory},
          {set.depth_sigmas_m, memory},
          {set.sigmas_px, memory}};
}

template <typename Item>
size_t BytesOf(const std::pmr::vector<Item>& items) {
  return items.empty() ? 0 : items.size() * sizeof(Item) + alignof(Item) - 1;
}

}  // namespace

size_t BytesOf(const FrameFeatures& features) {
  const FeatureSet& set = features.set;
  return BytesOf(set.keypoints) + BytesOf(set.descriptors) + BytesOf(set.depths_m) +
         BytesOf(set.depth_sigmas_m) + BytesOf(set.sigmas_px) + BytesOf(features.uv_px) +
         BytesOf(features.sigmas_px) + features.grid.Bytes();
}

FrameFeatures CopyInto(std::pmr::memory_resource* memory, const FrameFeatures& features) {
  return {CopyInto(memory, features.set),
          {features.uv_px, memory},
          {features.sigmas_px, memory},
          FeatureGrid(memory, features.grid)};
}

}  // namespace dmslam
