#include "dmslam/map/feature_store.h"

#include <memory_resource>
#include <utility>

namespace dmslam {
namespace {

/// Counts bytes as long as it lives.
class Counted {
 public:
  Counted(std::shared_ptr<std::atomic<size_t>> total, size_t bytes)
      : total_(std::move(total)), bytes_(bytes) {
    *total_ += bytes_;
  }
  ~Counted() { *total_ -= bytes_; }
  Counted(const Counted&) = delete;
  Counted& operator=(const Counted&) = delete;

 private:
  std::shared_ptr<std::atomic<size_t>> total_;
  size_t bytes_;
};

struct InMemory {
  std::shared_ptr<const FrameFeatures> features;
  Counted counted;
};

/// Features whose lists lie in pages of a file.
class InFile {
 public:
  InFile(std::shared_ptr<std::byte> pages, size_t bytes, const FrameFeatures& features,
         std::shared_ptr<std::atomic<size_t>> total)
      : pages_(std::move(pages)),
        memory_(pages_.get(), bytes, std::pmr::null_memory_resource()),
        features_(CopyInto(&memory_, features)),
        counted_(std::move(total), bytes) {}

  const FrameFeatures& features() const { return features_; }

 private:
  std::shared_ptr<std::byte> pages_;
  std::pmr::monotonic_buffer_resource memory_;
  FrameFeatures features_;
  Counted counted_;
};

}  // namespace

FeatureStore::FeatureStore(const FeatureStoreOptions& options, std::string folder)
    : most_bytes_(static_cast<size_t>(options.memory_mb * 1e6)),
      bytes_in_memory_(std::make_shared<std::atomic<size_t>>(0)),
      bytes_in_file_(std::make_shared<std::atomic<size_t>>(0)),
      file_(std::move(folder)) {}

std::shared_ptr<const FrameFeatures> FeatureStore::Keep(std::shared_ptr<const FrameFeatures> features) {
  const size_t bytes = BytesOf(*features);
  if (*bytes_in_memory_ + bytes > most_bytes_) {
    if (std::shared_ptr<std::byte> pages = TakePages(bytes)) {
      const auto kept = std::make_shared<const InFile>(std::move(pages), bytes, *features, bytes_in_file_);
      return {kept, &kept->features()};
    }
  }
  const FrameFeatures* at = features.get();
  return {std::shared_ptr<const InMemory>(new InMemory{std::move(features), {bytes_in_memory_, bytes}}), at};
}

std::shared_ptr<std::byte> FeatureStore::TakePages(size_t bytes) {
  const std::lock_guard lock(mutex_);
  std::shared_ptr<std::byte> pages = file_.Take(bytes);
  const bool fails = pages == nullptr;
  if (fails && !failing_) problem_ = file_.problem();
  failing_ = fails;
  return pages;
}

void FeatureStore::OnChange() {
  const std::lock_guard lock(mutex_);
  if (file_.used() && ++changes_ % kChangesBetween == 0) file_.LetGo();
}

void FeatureStore::LetGo() {
  const std::lock_guard lock(mutex_);
  file_.LetGo();
}

std::string FeatureStore::TakeProblem() {
  const std::lock_guard lock(mutex_);
  return std::exchange(problem_, {});
}

}  // namespace dmslam
