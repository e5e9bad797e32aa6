#include "dmslam/synthetic/sequence_writer.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <optional>

#include "dmslam/dataset/trajectory.h"
#include "dmslam/synthetic/revisits.h"
#include "dmslam/util/check.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

/// A text file that is checked when it is finished.
class TextFile {
 public:
  explicit TextFile(const fs::path& path) : path_(path.string()), out_(path, std::ios::binary) {}
  std::ostream& out() { return out_; }
  void Finish() {
    out_.flush();
    if (!out_) throw InputError(path_ + ": cannot be written; check that the folder exists and has space");
  }

 private:
  std::string path_;
  std::ofstream out_;
};

void WriteCamera(const Camera& camera, const fs::path& path) {
  TextFile file(path);
  file.out() << CameraText(camera);
  file.Finish();
}

void WriteLoops(const std::vector<Revisit>& revisits, const std::vector<StampedPose>& poses,
                const RevisitOptions& options, const fs::path& path) {
  nlohmann::ordered_json loops = nlohmann::ordered_json::array();
  for (const Revisit& revisit : revisits) {
    loops.push_back({{"frame", revisit.frame},
                     {"stamp", FormatStampNs(poses[revisit.frame].stamp_ns)},
                     {"earlier_frame", revisit.earlier_frame},
                     {"earlier_stamp", FormatStampNs(poses[revisit.earlier_frame].stamp_ns)},
                     {"shared_share", revisit.shared_share},
                     {"distance_m", revisit.distance_m},
                     {"angle_rad", revisit.angle_rad},
                     {"graph_distance", revisit.graph_distance}});
  }
  const nlohmann::ordered_json root = {{"frame_step", options.frame_step},
                                       {"min_graph_distance", options.min_graph_distance},
                                       {"revisits", loops}};
  TextFile file(path);
  file.out() << root.dump(1) << "\n";
  file.Finish();
}

double ShareOf(const GrayImage& mask, int at_least) {
  const auto count =
      std::count_if(mask.data.begin(), mask.data.end(), [&](uint8_t value) { return value >= at_least; });
  return static_cast<double>(count) / static_cast<double>(mask.data.size());
}

std::vector<uint8_t> Encode(const RenderedFrame& frame, const SequenceOptions& options) {
  if (options.png) return options.gray ? EncodePng(frame.gray) : EncodePng(frame.color);
  return options.gray ? EncodeJpeg(frame.gray, options.jpeg_quality)
                      : EncodeJpeg(frame.color, options.jpeg_quality);
}

void MakeFolders(const fs::path& root, bool masks) {
  std::error_code error;
  fs::create_directories(root / "rgb", error);
  if (!error && masks) fs::create_directories(root / "mask", error);
  if (error)
    throw InputError(root.string() + ": cannot be made (" + error.message() + "); choose another --out");
}

/// Stamps in whole microseconds, as the benchmark writes them.
int64_t StampOf(const SequenceOptions& options, int frame) {
  return options.first_stamp_ns + 1000 * std::llround(frame * 1e6 / options.camera.fps);
}

/// Writes the frames themselves and their lists.
class FrameWriter {
 public:
  FrameWriter(const SequenceOptions& options, const fs::path& root, bool masks)
      : options_(options),
        root_(root),
        masks_(masks),
        rgb_list_(root / "rgb.txt"),
        coverage_(root / "coverage.txt") {
    rgb_list_.out() << "# color images\n# timestamp filename\n";
    if (!masks_) return;
    mask_list_.emplace(root / "mask.txt");
    mask_list_->out()
        << "# actors (255 = moving in this frame, 128 = standing still)\n# timestamp filename\n";
  }
  void Write(const RenderedFrame& frame, int64_t stamp_ns, SequenceReport& report) {
    const std::string stamp = FormatStampNs(stamp_ns),
                      name = "rgb/" + stamp + (options_.png ? ".png" : ".jpg");
    WriteFileBytes((root_ / name).string(), Encode(frame, options_));
    rgb_list_.out() << stamp << ' ' << name << '\n';
    const double covered = ShareOf(frame.mask, 128), moving = ShareOf(frame.mask, 255);
    char line[32];
    std::snprintf(line, sizeof(line), "%.4f\n", covered);
    coverage_.out() << line;
    report.mean_coverage += covered;
    report.mean_moving_coverage += moving;
    ++report.frames;
    if (!masks_) return;
    WriteFileBytes((root_ / ("mask/" + stamp + ".png")).string(), EncodePng(frame.mask));
    mask_list_->out() << stamp << " mask/" << stamp << ".png\n";
  }
  void Finish(SequenceReport& report) {
    rgb_list_.Finish();
    coverage_.Finish();
    if (mask_list_) mask_list_->Finish();
    report.mean_coverage /= std::max(1, report.frames);
    report.mean_moving_coverage /= std::max(1, report.frames);
  }

 private:
  const SequenceOptions& options_;
  fs::path root_;
  bool masks_;
  TextFile rgb_list_, coverage_;
  std::optional<TextFile> mask_list_;
};

void WriteDescription(const SequenceOptions& options, const World& world, const SequenceReport& report,
                      const fs::path& path) {
  nlohmann::ordered_json root = {{"frames", report.frames},
                                 {"fps", options.camera.fps},
                                 {"scene_seed", options.world.scene.seed},
                                 {"path_seed", options.world.path.seed},
                                 {"actor_seed", options.world.actor.seed},
                                 {"noise_seed", options.render.seed},
                                 {"actors", world.actors()},
                                 {"path_m", report.path_m},
                                 {"round_s", world.path().period_s()},
                                 {"mean_coverage", report.mean_coverage},
                                 {"mean_moving_coverage", report.mean_moving_coverage},
                                 {"revisits", report.revisits}};
  if (world.props() > 0) root["props"] = world.props();
  TextFile file(path);
  file.out() << root.dump(1) << "\n";
  file.Finish();
}

void CheckOptions(const SequenceOptions& options) {
  if (options.frames < 1) throw InputError("--frames: must be at least 1");
  if (options.jpeg_quality < 1 || options.jpeg_quality > 100)
    throw InputError("--quality: must lie in 1..100");
  if (const auto problem = options.camera.Problem()) throw InputError("camera: " + *problem);
}

}  // namespace

int DefaultRoundFrames(const SequenceOptions& options) {
  SceneOptions quick = options.world.scene;
  quick.texture_halvings = 4;  // Only where things stand matters here.
  const CameraPath path(BuildScene(quick), options.world.path);
  return std::max(1500, static_cast<int>(std::ceil(1.15 * path.period_s() * options.camera.fps)));
}

SequenceReport WriteSequence(const SequenceOptions& given, const std::string& folder,
                             const std::function<bool(int)>& progress) {
  CheckOptions(given);
  SequenceOptions options = given;
  options.world.duration_s = given.frames / given.camera.fps;
  options.render.depth = false;
  const World world(options.world, options.camera);
  const fs::path root(folder);
  const bool masks = options.masks && world.actors() + world.props() > 0;
  MakeFolders(root, masks);
  Renderer renderer(options.camera, options.render);
  FrameWriter writer(options, root, masks);
  SequenceReport report;
  std::vector<StampedPose> poses;
  std::vector<Rigid3d> T_world_cam;
  for (int i = 0; i < options.frames; ++i) {
    const int64_t stamp_ns = StampOf(options, i);
    const double time_s = static_cast<double>(stamp_ns - options.first_stamp_ns) * 1e-9;
    writer.Write(RenderFrame(world, renderer, time_s, static_cast<uint64_t>(i)), stamp_ns, report);
    T_world_cam.push_back(world.path().T_world_cam(time_s));
    poses.push_back({stamp_ns, T_world_cam.back()});
    if (i > 0)
      report.path_m +=
          (poses[poses.size() - 1].T_world_cam.translation - poses[poses.size() - 2].T_world_cam.translation)
              .norm();
    if (progress && !progress(i + 1)) break;
  }
  writer.Finish(report);
  WriteTrajectory((root / "groundtruth.txt").string(), poses);
  WriteCamera(options.camera, root / "camera.yaml");
  RevisitOptions revisit_options;
  revisit_options.frame_step =
      std::max(1, static_cast<int>(std::lround(options.camera.fps / 3)));  // As keyframes come.
  const std::vector<Revisit> revisits =
      FindRevisits(world.scene(), options.camera, T_world_cam, revisit_options);
  report.revisits = revisits.size();
  WriteLoops(revisits, poses, revisit_options, root / "loops.json");
  WriteDescription(options, world, report, root / "synthetic.json");
  return report;
}

}  // namespace dmslam
