#include "run/source_check.h"

#include <cstdint>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/dataset/frame_source.h"
#include "dmslam/dataset/image.h"
#include "dmslam/dataset/play_changes.h"
#include "dmslam/dataset/seen_as.h"
#include "dmslam/messaging/bus_key.h"
#include "dmslam/recording/recorded_frames.h"
#include "dmslam/runtime/process_main.h"
#include "dmslam/util/check.h"
#include "run/log_replay.h"

namespace dmslam {
namespace {

Camera CameraOf(const std::string& file, const std::string& sequence) {
  return file.empty() ? KnownCamera(sequence, FindDataFolder("config")) : LoadCamera(file);
}

std::unique_ptr<RecordedFrames> OpenLog(const std::string& log, const RunArguments& a) {
  return std::make_unique<RecordedFrames>(
      std::make_shared<const LogIndex>(log, BusKey::LoadIfWanted(a.bus.key)), 0);
}

std::unique_ptr<FrameSource> OpenSequence(const std::string& path, const std::string& camera_file,
                                          const RunArguments& a) {
  FrameSourceOptions options;
  if (a.camera.fps > 0) {
    options.fps = a.camera.fps;
  } else if (!camera_file.empty()) {
    options.fps = LoadCamera(camera_file).fps;
  }
  return OpenFrameSource(path, options);
}

uint64_t NumberOr(const std::string& text, uint64_t none) { return text.empty() ? none : std::stoull(text); }

std::string SizeText(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

/// One that cannot be read is not judged: the player leaves it out, and says so.
void CheckSize(FrameSource* source, size_t index, const Camera& camera) {
  GrayImage image;
  try {
    EncodedImage encoded = source->Read(index);
    if (encoded.encoding == ImageEncoding::kFile) encoded.encoding = DetectEncoding(encoded.bytes);
    image = DecodeGray(encoded, source->Name(index));
  } catch (const InputError&) {
    return;
  }
  if (image.width == camera.width_px && image.height == camera.height_px) return;
  throw MisfitError(source->Name(index) + ": is " + SizeText(image.width, image.height) +
                    " pixels, but the camera file says " + SizeText(camera.width_px, camera.height_px) +
                    "; give the camera file that belongs to the sequence");
}

/// `name`: what to call the recording.
void CheckFrames(const std::string& name, FrameSource* source, const Camera& camera, const RunArguments& a) {
  const uint64_t start = NumberOr(a.source.start, 0);
  if (start >= source->size() || NumberOr(a.source.frames, 1) == 0) {
    throw InputError(name + ": --start " + std::to_string(start) + " leaves no frame of " +
                     std::to_string(source->size()));
  }
  CheckSize(source, start, camera);
  source->GroundTruth();  // reads it
}

void CheckLive(const std::string& camera, const RunArguments& a) {
  if (a.pace.lockstep) throw InputError(camera + ": a camera waits for nobody; leave --lockstep out");
}

void CheckFirst(const RunArguments& a, const Camera& camera) {
  if (!a.source.replay.empty()) {
    PrefixOfCamera(a.source.replay);
  } else if (!a.source.log.empty()) {
    CheckFrames(a.source.log, OpenLog(a.source.log, a).get(), camera, a);
  } else if (IsCamera(a.source.sequence)) {
    CheckLive(a.source.sequence, a);
  } else {
    CheckFrames(a.source.sequence, OpenSequence(a.source.sequence, a.camera.file, a).get(), camera, a);
  }
}

/// A camera that is not told by the first one's model must be of it.
void CheckModel(const std::string& path, const Camera& camera, const RunArguments& a, const Camera& first) {
  const auto difference = FirstDifference(camera, first);
  if (!difference) return;
  throw MisfitError(path + ": its camera has " + difference->a + ", that of " + a.source.sequence + " has " +
                    difference->b +
                    "; name the files of both, with --camera and --also-camera (docs/many-cameras.md)");
}

void CheckOther(const std::string& path, const std::string& own_file, const RunArguments& a,
                const Camera& first) {
  const bool told_by_first = !own_file.empty();
  const std::string& file = told_by_first ? own_file : a.camera.file;
  const Camera camera = CameraOf(file, path);
  if (!told_by_first) CheckModel(path, camera, a, first);
  if (IsCamera(path)) {
    if (told_by_first) throw InputError("--also-camera is for recordings; " + path + " is a camera");
    return CheckLive(path, a);
  }
  auto source = OpenSequence(path, file, a);
  CheckFrames(path, source.get(), camera, a);
  if (told_by_first) SeenAs(std::move(source), camera, first, path);
}

}  // namespace

Camera CameraThatPlays(const RunArguments& a) {
  const std::string& log = a.source.log.empty() ? a.source.replay : a.source.log;
  if (!a.camera.file.empty() || log.empty()) return CameraOf(a.camera.file, a.source.sequence);
  return OpenLog(log, a)->camera_info().camera;
}

Settings SettingsOf(const RunArguments& a) {
  std::vector<std::string> overrides;
  if (!a.settings.profile.empty()) overrides.push_back("profile=" + a.settings.profile);
  overrides.insert(overrides.end(), a.settings.sets.begin(), a.settings.sets.end());
  if (a.settings.no_loop) overrides.emplace_back("loop.enabled=off");
  if (!a.map.begin.empty()) overrides.emplace_back("map.saved=on");
  if (a.map.localize) overrides.emplace_back("map.localize_only=on");
  overrides.push_back("seed=" + a.settings.seed);
  return LoadSettings(a.settings.config, overrides);
}

void CheckSources(const RunArguments& a) {
  SettingsOf(a);
  for (const std::string& text : a.source.black_outs) ParseBlackOut(text);
  for (const std::string& text : a.source.jumps) ParseJump(text);
  const Camera camera = CameraThatPlays(a);
  CheckFirst(a, camera);
  for (size_t i = 0; i < a.source.others.size(); ++i)
    CheckOther(a.source.others[i], a.source.other_cameras.empty() ? "" : a.source.other_cameras[i], a,
               camera);
}

}  // namespace dmslam
