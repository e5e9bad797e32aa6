#include "dmslam/dataset/tum_sequence.h"

#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include "dmslam/dataset/text_table.h"
#include "dmslam/util/check.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

StampedFile ParseEntry(std::span<const std::string_view> fields, const fs::path& folder,
                       const std::string& where) {
  if (fields.size() != 2) {
    throw InputError(where + ": has " + std::to_string(fields.size()) +
                     " columns; write two: stamp and file name");
  }
  const std::optional<int64_t> stamp_ns = ParseStampNs(fields[0]);
  if (!stamp_ns) {
    throw InputError(where + ": '" + std::string(fields[0]) + "' is not a stamp; write decimal seconds");
  }
  RequireStampOfImage(*stamp_ns, where);
  return {*stamp_ns, (folder / fields[1]).string()};
}

}  // namespace

std::vector<StampedFile> ReadStampedFiles(const std::string& list_path) {
  const fs::path folder = fs::path(list_path).parent_path();
  std::vector<StampedFile> files;
  ForEachRow(ReadTextFile(list_path), " \t", [&](size_t line, std::span<const std::string_view> fields) {
    StampedFile file = ParseEntry(fields, folder, FileLine(list_path, line));
    if (!files.empty() && file.stamp_ns <= files.back().stamp_ns) {
      const bool same = file.stamp_ns == files.back().stamp_ns;
      throw InputError(FileLine(list_path, line) + ": stamp " + FormatStampNs(file.stamp_ns) +
                       (same ? " repeats the one before; remove one of them"
                             : " is earlier than the one before; sort the list by stamp"));
    }
    files.push_back(std::move(file));
  });
  return files;
}

std::optional<StampedFile> FindNearest(const std::vector<StampedFile>& files, int64_t stamp_ns,
                                       int64_t tolerance_ns) {
  const auto next =
      std::lower_bound(files.begin(), files.end(), stamp_ns,
                       [](const StampedFile& file, int64_t stamp) { return file.stamp_ns < stamp; });
  const StampedFile* best = nullptr;
  int64_t best_distance_ns = tolerance_ns;
  if (next != files.end() && next->stamp_ns - stamp_ns <= best_distance_ns) {
    best = &*next;
    best_distance_ns = next->stamp_ns - stamp_ns;
  }
  if (next != files.begin() && stamp_ns - std::prev(next)->stamp_ns <= best_distance_ns)
    best = &*std::prev(next);
  return best ? std::optional<StampedFile>(*best) : std::nullopt;
}

TumSequence::TumSequence(const std::string& folder) {
  const fs::path root(folder);
  if (!fs::is_directory(root)) throw InputError(folder + ": no such folder; check the path of the sequence");
  const fs::path list = root / "rgb.txt";
  if (!fs::exists(list))
    throw InputError(folder + ": has no rgb.txt; a TUM RGB-D folder lists its images there");
  const std::vector<StampedFile> listed = ReadStampedFiles(list.string());
  if (listed.empty())
    throw InputError(list.string() + ": lists no image; write lines of stamp and file name");
  for (const StampedFile& file : listed) {
    if (fs::is_regular_file(file.path)) frames_.push_back(file);
  }
  missing_ = listed.size() - frames_.size();
  if (frames_.empty()) {
    throw InputError(list.string() + ": none of its " + std::to_string(listed.size()) +
                     " images is there (first: " + listed.front().path +
                     "); fetch the images or correct the list");
  }
  if (fs::exists(root / "mask.txt")) masks_ = ReadStampedFiles((root / "mask.txt").string());
  if (fs::exists(root / "groundtruth.txt")) ground_truth_path_ = (root / "groundtruth.txt").string();
}

EncodedImage TumSequence::Read(size_t index) {
  EncodedImage image;
  image.bytes = ReadFileBytes(frames_.at(index).path);
  image.encoding = DetectEncoding(image.bytes);
  return image;
}

}  // namespace dmslam
