#pragma once

#include <atomic>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "dmslam/features/frame_features.h"
#include "dmslam/util/page_file.h"

namespace dmslam {

/// How much a process keeps in memory of a map that grows.
struct FeatureStoreOptions {
  double memory_mb = 256.0;

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Number("map.features_mb", memory_mb, 0, 1e6, "MB",
             "of keyframes' features in the memory of each process that holds the map; those of further "
             "keyframes lie in a file of TMPDIR (or /var/tmp) that has no name");
    v.ChangesNoResult();
  }
};

/// Where the features of a map's keyframes lie: in memory as long as they are few, those of further keyframes
/// in a file whose pages the kernel reads when they are used. They are the same bits in either place and stay
/// where they are, so readers need not know of it. A map of usual size never comes to the file.
///
/// Where the disk has no room all stays in memory, and `TakeProblem` tells it.
///
/// Several threads may use it, each with its own map.
class FeatureStore {
 public:
  explicit FeatureStore(const FeatureStoreOptions& options, std::string folder = FolderForPages());

  /// The features as they are kept: themselves, or a copy in the file.
  std::shared_ptr<const FrameFeatures> Keep(std::shared_ptr<const FrameFeatures> features);
  /// To be called with each change of a map: now and then what was read of the file leaves the memory.
  void OnChange();
  /// The same at once.
  void LetGo();

  size_t bytes_in_memory() const { return *bytes_in_memory_; }
  size_t bytes_in_file() const { return *bytes_in_file_; }
  /// What keeps features out of the file. Reported once per occurrence; empty if nothing new.
  std::string TakeProblem();

 private:
  using Count = std::shared_ptr<std::atomic<size_t>>;

  std::shared_ptr<std::byte> TakePages(size_t bytes);

  /// Changes between two times at which what was read leaves the memory: each brings a keyframe or two.
  static constexpr uint64_t kChangesBetween = 64;

  size_t most_bytes_;
  Count bytes_in_memory_;  ///< of features that are still held, by whatever map
  Count bytes_in_file_;
  std::mutex mutex_;  ///< of what follows
  PageFile file_;
  uint64_t changes_ = 0;
  bool failing_ = false;
  std::string problem_;
};

}  // namespace dmslam
