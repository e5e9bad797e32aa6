#pragma once

#include <cstdint>
#include <string>

namespace dmslam {

/// What `dmslam-vocab train` is asked to do.
struct TrainCommand {
  std::string images;  ///< folder of images (searched with its subfolders), or a TUM RGB-D sequence
  std::string out;     ///< .txt: DBoW2's text format; else the binary one
  int branching = 10;
  int levels = 5;
  int features = 1000;  ///< most features per image
  int min_split = 4;
  int every = 1;  ///< use every n-th image
  uint64_t seed = 1;
};

/// Each throws InputError; progress goes to standard error and only to a terminal.
void Train(const TrainCommand& command);
void PrintInfo(const std::string& path);
void Convert(const std::string& from, const std::string& to);

}  // namespace dmslam
