#include "dmslam/dataset/frame_source.h"

#include <algorithm>
#include <filesystem>

#include "dmslam/dataset/image_folder.h"
#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/dataset/video_source.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

bool IsLetterOrDigit(char c) { return (c >= 'a' && c <= 'z') || (c >= '0' && c <= '9'); }

std::string LowerCase(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  return text;
}

/// Whether `word` stands in `text` with no letter or digit before it, and none after it.
bool ContainsWord(const std::string& text, const std::string& word) {
  for (size_t at = text.find(word); at != std::string::npos; at = text.find(word, at + 1)) {
    const bool starts = at == 0 || !IsLetterOrDigit(text[at - 1]);
    const size_t end = at + word.size();
    if (starts && (end == text.size() || !IsLetterOrDigit(text[end]))) return true;
  }
  return false;
}

}  // namespace

std::vector<StampedPose> FrameSource::GroundTruth() const {
  const std::optional<std::string> path = GroundTruthPath();
  return path ? ReadTrajectory(*path) : std::vector<StampedPose>();
}

std::unique_ptr<FrameSource> OpenFrameSource(const std::string& path, const FrameSourceOptions& options) {
  if (fs::is_regular_file(path)) return OpenVideo(path, options.fps);
  if (!fs::is_directory(path))
    throw InputError(path + ": no such file or folder; check the path of the sequence");
  if (fs::exists(fs::path(path) / "rgb.txt")) return std::make_unique<TumSequence>(path);
  if (EurocSequence::CameraFolder(path)) return std::make_unique<EurocSequence>(path);
  if (ImageFolder::Recognises(path)) return std::make_unique<ImageFolder>(path, options.fps);
  throw InputError(
      path +
      ": is no sequence; looked for rgb.txt (TUM RGB-D), mav0/cam0/data.csv (EuRoC) and numbered images");
}

std::optional<std::string> TumCameraName(const std::string& sequence_dir) {
  fs::path path = fs::absolute(sequence_dir).lexically_normal();
  if (!path.has_filename()) path = path.parent_path();
  for (; path.has_filename(); path = path.parent_path()) {
    const std::string name = LowerCase(path.filename().string());
    for (const char digit : {'1', '2', '3'}) {
      if (ContainsWord(name, std::string("freiburg") + digit) ||
          ContainsWord(name, std::string("fr") + digit)) {
        return std::string("TUM") + digit;
      }
    }
  }
  return std::nullopt;
}

std::optional<Camera> FindCamera(const std::string& sequence_dir, const std::string& config_dir) {
  const fs::path own = fs::path(sequence_dir) / "camera.yaml";
  if (fs::exists(own)) return LoadCamera(own.string());
  if (const auto camera_folder = EurocSequence::CameraFolder(sequence_dir)) {
    const fs::path sensor = fs::path(*camera_folder) / "sensor.yaml";
    if (fs::exists(sensor)) return EurocSequence::ReadCamera(sensor.string());
  }
  if (const auto name = TumCameraName(sequence_dir))
    return LoadCamera((fs::path(config_dir) / (*name + ".yaml")).string());
  return std::nullopt;
}

Camera KnownCamera(const std::string& sequence_dir, const std::string& config_dir) {
  if (const auto found = FindCamera(sequence_dir, config_dir)) return *found;
  throw InputError(sequence_dir +
                   ": which camera took this is not known; name its file with --camera (config/ has some; "
                   "see docs/camera.md)");
}

}  // namespace dmslam
