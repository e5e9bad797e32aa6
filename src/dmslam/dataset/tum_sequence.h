#pragma once

#include <optional>
#include <string>
#include <vector>

#include "dmslam/dataset/frame_source.h"

namespace dmslam {

/// A file that belongs to an instant.
struct StampedFile {
  int64_t stamp_ns = 0;
  std::string path;  ///< As given in the list, below the sequence's folder.
};

/// Reads a list "stamp file" as the TUM RGB-D benchmark has it ('#' starts a comment line); paths are taken
/// relative to the list's folder. Throws InputError with file and line for anything else than two columns,
/// for a stamp that is no decimal number or below zero, and for stamps that repeat or go back.
std::vector<StampedFile> ReadStampedFiles(const std::string& list_path);

/// The entry whose stamp is nearest to `stamp_ns`, if it is at most `tolerance_ns` away.
std::optional<StampedFile> FindNearest(const std::vector<StampedFile>& files, int64_t stamp_ns,
                                       int64_t tolerance_ns);

/// A folder in the format of the TUM RGB-D benchmark: rgb.txt lists the images; groundtruth.txt and mask.txt
/// may be there. Images that rgb.txt lists and that are not there are counted and left out.
class TumSequence : public FrameSource {
 public:
  /// Throws InputError for a folder or rgb.txt that is not there, malformed lists, and when not one image
  /// exists.
  explicit TumSequence(const std::string& folder);

  size_t size() const override { return frames_.size(); }
  int64_t StampNs(size_t index) const override { return frames_.at(index).stamp_ns; }
  std::string Name(size_t index) const override { return frames_.at(index).path; }
  EncodedImage Read(size_t index) override;
  size_t missing() const override { return missing_; }
  std::optional<std::string> GroundTruthPath() const override { return ground_truth_path_; }

  const std::vector<StampedFile>& frames() const { return frames_; }
  /// Masks of moving things (255 moving, 128 an actor standing still), empty where there are none.
  const std::vector<StampedFile>& masks() const { return masks_; }
  /// How many images rgb.txt lists, there or not.
  size_t listed() const { return frames_.size() + missing_; }

 private:
  std::vector<StampedFile> frames_;
  std::vector<StampedFile> masks_;
  size_t missing_ = 0;
  std::optional<std::string> ground_truth_path_;
};

}  // namespace dmslam
