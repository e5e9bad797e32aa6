#include "run/source_check.h"

#include <algorithm>
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
#include "dmslam/runtime/load_vocabulary.h"
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

/// Which of `frames` frames are played. `name`: what to call the recording. Returns the first one.
size_t CheckStart(const std::string& name, size_t frames, const RunArguments::Source& source) {
  const uint64_t start = NumberOr(source.start, 0);
  if (start >= frames || NumberOr(source.frames, 1) == 0) {
    throw InputError(name + ": --start " + std::to_string(start) + " leaves no frame of " +
                     std::to_string(frames));
  }
  return start;
}

/// `name`: what to call the recording. Returns how many frames it has.
size_t CheckFrames(const std::string& name, FrameSource* source, const Camera& camera,
                   const RunArguments& a) {
  CheckSize(source, CheckStart(name, source->size(), a.source), camera);
  source->GroundTruth();  // reads it
  return source->size();
}

/// Of a camera nobody knows how many frames there will be.
size_t CheckLive(const std::string& camera, const RunArguments& a) {
  if (a.pace.lockstep) throw InputError(camera + ": a camera waits for nobody; leave --lockstep out");
  return SIZE_MAX;
}

/// lcm-logplayer plays whole logs; only of which frames are chosen or changed a copy is made.
size_t CheckReplay(const std::string& log, const RunArguments& a) {
  PrefixOfCamera(log);
  const RunArguments::Source& source = a.source;
  if (source.start.empty() && source.frames.empty() && source.black_outs.empty() && source.jumps.empty())
    return SIZE_MAX;
  const size_t frames = OpenLog(log, a)->size();
  CheckStart(log, frames, source);
  return frames;
}

/// Each of these returns how many frames there are.
size_t CheckFirst(const RunArguments& a, const Camera& camera) {
  const std::string& sequence = a.source.sequence;
  if (!a.source.replay.empty()) return CheckReplay(a.source.replay, a);
  if (!a.source.log.empty()) return CheckFrames(a.source.log, OpenLog(a.source.log, a).get(), camera, a);
  if (IsCamera(sequence)) return CheckLive(sequence, a);
  return CheckFrames(sequence, OpenSequence(sequence, a.camera.file, a).get(), camera, a);
}

/// A camera that is not told by the first one's model must be of it.
void CheckModel(const std::string& path, const Camera& camera, const RunArguments& a, const Camera& first) {
  const auto difference = FirstDifference(camera, first);
  if (!difference) return;
  throw MisfitError(path + ": its camera has " + difference->a + ", that of " + a.source.sequence + " has " +
                    difference->b +
                    "; name the files of both, with --camera and --also-camera (docs/many-cameras.md)");
}

size_t CheckOther(const std::string& path, const std::string& own_file, const RunArguments& a,
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
  const size_t frames = CheckFrames(path, source.get(), camera, a);
  if (told_by_first) SeenAs(std::move(source), camera, first, path);
  return frames;
}

/// Only frames that there are can be changed. `frames`: of the longest recording.
void CheckChanges(const RunArguments::Source& source, size_t frames) {
  const auto check = [&](const std::string& option, size_t frame) {
    if (frame < frames) return;
    throw InputError(option + ": there is no frame " + std::to_string(frame) + ", the last of " +
                     std::to_string(frames) + " frames is " + std::to_string(frames - 1));
  };
  for (const std::string& text : source.black_outs) check("--black-out " + text, ParseBlackOut(text).from);
  for (const std::string& text : source.jumps) check("--jump " + text, ParseJump(text).to);
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
  if (!a.settings.vocabulary.empty()) LoadVocabulary(a.settings.vocabulary);
  const Camera camera = CameraThatPlays(a);
  size_t longest = CheckFirst(a, camera);
  for (size_t i = 0; i < a.source.others.size(); ++i) {
    const std::string own_file = a.source.other_cameras.empty() ? "" : a.source.other_cameras[i];
    longest = std::max(longest, CheckOther(a.source.others[i], own_file, a, camera));
  }
  CheckChanges(a.source, longest);
}

}  // namespace dmslam
