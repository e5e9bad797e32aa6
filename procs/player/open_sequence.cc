#include "player/open_sequence.h"

#include <utility>

#include "dmslam/dataset/seen_as.h"
#include "dmslam/runtime/process_main.h"

namespace dmslam {

Camera ChooseCamera(const std::string& camera_file, const std::string& sequence) {
  if (!camera_file.empty()) return LoadCamera(camera_file);
  return KnownCamera(sequence, FindDataFolder("config"));
}

std::unique_ptr<FrameSource> OpenSequence(const std::string& camera_file, double fps,
                                          PlayerOptions* options) {
  FrameSourceOptions source_options;
  if (fps > 0) source_options.fps = fps;
  if (fps <= 0 && !camera_file.empty()) source_options.fps = LoadCamera(camera_file).fps;
  auto source = OpenFrameSource(options->sequence, source_options);
  options->camera = ChooseCamera(camera_file, options->sequence);
  return source;
}

std::unique_ptr<FrameSource> TellBy(const Camera& as, std::unique_ptr<FrameSource> source,
                                    PlayerOptions* options) {
  auto seen = SeenAs(std::move(source), options->camera, as, options->sequence);
  const double fps = std::exchange(options->camera, as).fps;
  options->camera.fps = fps;
  return seen;
}

}  // namespace dmslam
