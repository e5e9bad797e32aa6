#include "small_workload.h"

#include <cstdlib>
#include <filesystem>
#include <memory>

#include "dmslam/dataset/tum_sequence.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/synthetic/sequence_writer.h"
#include "in_process.h"

namespace dmslam::simulation {
namespace {

namespace fs = std::filesystem;

SequenceOptions SmallSequence() {
  constexpr double kFps = 15;
  SequenceOptions options;
  options.camera.width_px = 320;
  options.camera.height_px = 240;
  options.camera.fx_px = options.camera.fy_px = 262.5;
  options.camera.cx_px = 159.5;
  options.camera.cy_px = 119.5;
  options.camera.fps = kFps;
  options.frames = 60;
  options.world.duration_s = options.frames / kFps;
  options.world.path.kind = PathKind::kXyz;
  options.world.actors = 1;
  options.gray = true;
  options.masks = false;
  options.jpeg_quality = 80;
  options.render.samples = 1;
  return options;
}

fs::path Project() {
  const char* source_dir = std::getenv("DMSLAM_SOURCE_DIR");
  return source_dir != nullptr ? fs::path(source_dir) : fs::current_path();
}

}  // namespace

Workload MakeSmallWorkload(const std::string& folder) {
  WriteSequence(SmallSequence(), folder, {});
  Workload workload;
  workload.camera = SmallSequence().camera;
  workload.vocabulary =
      std::make_shared<const Vocabulary>(LoadOrbVocabulary((Project() / "data/vocabulary.dmv").string()));
  workload.settings = SmallSettings(1);
  TumSequence frames(folder);
  for (size_t i = 0; i < frames.size(); ++i) {
    StoredFrame& stored = workload.frames.emplace_back(StoredFrame{frames.StampNs(i), frames.Read(i)});
    stored.image.encoding = DetectEncoding(stored.image.bytes);
  }
  return workload;
}

Settings SmallSettings(uint64_t seed, int features) {
  return LoadSettings("", {"features.count=" + std::to_string(features), "seed=" + std::to_string(seed)});
}

Outcome RunUndisturbed(const Workload& workload, const Settings& settings, const std::string& folder,
                       size_t start) {
  fs::create_directories(folder);
  InProcessOptions options;
  options.node.settings = settings;
  options.player.session = 1;
  options.player.camera = workload.camera;
  options.player.sequence = "simulated";
  options.player.start = start;
  options.collector.out_dir = folder;
  options.collector.ground_truth = {"-"};
  options.collector.for_people = false;
  options.vocabulary = workload.vocabulary;
  Outcome outcome;
  RunInProcess(options, std::make_unique<StoredFrames>(&workload.frames), &outcome.failure);
  ReadResults(folder, &outcome);
  return outcome;
}

}  // namespace dmslam::simulation
