// dmslam-synth: renders a synthetic sequence into a folder in the format of the TUM RGB-D benchmark.

#include <unistd.h>

#include <chrono>
#include <cmath>
#include <cstdio>
#include <string>

#include "dmslam/camera/camera.h"
#include "dmslam/console/command_line.h"
#include "dmslam/synthetic/sequence_writer.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"

namespace {

struct Arguments {
  std::string out, camera, scene, path, behaviour = "walk", preset;
  int frames = 0, actors = 0;
  double fps = 30, moving_share = 0;
  uint64_t seed = 1;
  bool quiet = false;
  dmslam::SequenceOptions sequence;
};

void AddOptions(dmslam::CommandLine& app, Arguments& args) {
  app.AddOption("--out", args.out, "Folder to write into (it is made where it is not there)").Required();
  app.AddOption("--scene", args.scene,
                "room | office | hall | workshop | corridor | aliased (default: what the path needs)");
  app.AddOption("--path", args.path,
                "static | xyz | rpy | halfsphere | turn | tour | forward | ring (default: xyz)");
  app.AddOption(
      "--preset", args.preset,
      "walking_xyz | walking_rpy | walking_halfsphere | static_xyz: as the sequences of the TUM benchmark: "
      "same kind of motion, length and rate, two people who walk and sit (none in static_xyz)");
  app.AddOption("--frames", args.frames,
                "Frames to render (default: 300; tour and ring: 1.15 rounds, 1500 at least)");
  app.AddOption("--fps", args.fps, "Frames per second").ShowDefault();
  app.AddOption("--seed", args.seed, "Seed of everything: scene, path, people, noise").ShowDefault();
  app.AddOption("--moving-share", args.moving_share,
                "Mean share of the image covered by people and other things that move, 0..0.8");
  app.AddOption("--actors", args.actors, "How many people (default: as many as the moving share takes)");
  app.AddOption("--behaviour", args.behaviour, "walk | stop-and-go | sit").ShowDefault();
  app.AddFlag("--carry", args.sequence.world.props.carried_box, "The first person carries a box");
  app.AddFlag("--cart", args.sequence.world.props.cart, "A cart rolls about by itself, and stops at times");
  app.AddFlag("--door", args.sequence.world.props.door, "A door opens and closes (not in --scene aliased)");
  app.AddFlag("--screen", args.sequence.world.props.screen, "A large screen plays videos");
  app.AddOption("--stand-first", args.sequence.world.actor.stand_first_s,
                "Seconds that people stand still at first");
  app.AddOption("--static-start", args.sequence.world.path.static_start_s,
                "Seconds that the camera stands still at first");
  app.AddOption("--speed", args.sequence.world.path.speed_mps,
                "Walking speed of tour, forward and ring [m/s]");
  app.AddOption("--ring-length", args.sequence.world.scene.ring_length_m,
                "Length of the ring of corridors [m]")
      .ShowDefault();
  app.AddOption("--camera", args.camera,
                "Camera file; its distortion is applied (default: 640x480, fx = fy = 525)");
  app.AddOption("--samples", args.sequence.render.samples, "Pictures averaged per frame: 1 quick, 4 smooth")
      .ShowDefault()
      .InRange(1, 64);
  app.AddOption("--exposure", args.sequence.render.exposure_s, "Exposure time [s]: how much motion blurs")
      .ShowDefault();
  app.AddOption("--tremor", args.sequence.world.path.tremor, "How much the hand shakes (1 = ordinary)")
      .ShowDefault();
  app.AddFlag("--png", args.sequence.png, "Write PNG instead of JPEG");
  app.AddFlag("--gray", args.sequence.gray, "Write grey images");
  app.AddOption("--quality", args.sequence.jpeg_quality, "JPEG quality").ShowDefault();
  app.AddFlag("--quiet", args.quiet, "No progress");
}

/// Fills in what the preset stands for; what the user gave goes before.
void ApplyPreset(Arguments& args) {
  if (args.preset.empty()) return;
  struct Preset {
    const char *name, *path;
    int frames, actors;
    double share;
  };
  static constexpr Preset kPresets[] = {{"walking_xyz", "xyz", 859, 2, 0.3},
                                        {"walking_rpy", "rpy", 910, 2, 0.3},
                                        {"walking_halfsphere", "halfsphere", 1067, 2, 0.3},
                                        {"static_xyz", "xyz", 798, 0, 0}};
  for (const Preset& preset : kPresets) {
    if (args.preset != preset.name) continue;
    if (args.path.empty()) args.path = preset.path;
    if (args.frames == 0) args.frames = preset.frames;
    if (preset.actors > 0) {
      if (args.actors == 0) args.actors = preset.actors;
      if (args.moving_share <= 0) args.moving_share = preset.share;
      args.behaviour = "sit";
    }
    return;
  }
  throw dmslam::InputError(
      "--preset: '" + args.preset +
      "' is not known; choose walking_xyz, walking_rpy, walking_halfsphere or static_xyz");
}

dmslam::SequenceOptions ToSequenceOptions(Arguments& args) {
  ApplyPreset(args);
  dmslam::SequenceOptions options = args.sequence;
  if (!args.camera.empty()) options.camera = dmslam::LoadCamera(args.camera);
  options.camera.fps = args.fps;
  if (args.path.empty())
    args.path = args.scene == "corridor" ? "ring" : args.scene == "aliased" ? "tour" : "xyz";
  if (args.scene.empty()) args.scene = args.path == "ring" ? "corridor" : "room";
  options.world.path.kind = dmslam::ParsePathKind(args.path);
  options.world.scene.kind = dmslam::ParseSceneKind(args.scene);
  options.world.scene.doorway = options.world.props.door;
  options.world.actor.behaviour = dmslam::ParseBehaviour(args.behaviour);
  options.world.actors = args.actors;
  options.world.moving_share = args.moving_share;
  options.world.scene.seed = options.world.path.seed = options.world.actor.seed = options.world.props.seed =
      options.render.seed = args.seed;
  options.frames = args.frames;
  if (options.frames == 0) {
    const bool round = args.path == "tour" || args.path == "ring";
    options.frames = 300;
    if (round) options.frames = dmslam::DefaultRoundFrames(options);
  }
  return options;
}

void Run(Arguments& args) {
  const dmslam::SequenceOptions options = ToSequenceOptions(args);
  const auto start = std::chrono::steady_clock::now();
  const bool show = !args.quiet && isatty(STDERR_FILENO) != 0;
  const auto seconds = [&] {
    return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  };
  const dmslam::SequenceReport report = dmslam::WriteSequence(options, args.out, [&](int done) {
    if (show && (done % 10 == 0 || done == options.frames)) {
      std::fprintf(stderr, "\r%d of %d frames, %.0f s left  ", done, options.frames,
                   seconds() / done * (options.frames - done));
    }
    return true;
  });
  if (show) std::fprintf(stderr, "\n");
  if (args.quiet) return;
  std::printf(
      "%s: %d frames, path %.1f m, people cover %.1f %% (moving %.1f %%), %zu revisits, %.1f frames/s\n",
      args.out.c_str(), report.frames, report.path_m, 100 * report.mean_coverage,
      100 * report.mean_moving_coverage, report.revisits, report.frames / seconds());
}

}  // namespace

int main(int argc, char** argv) {
  dmslam::CommandLine app(
      "Renders a synthetic sequence (textured room, hand-held camera, walking people, exact ground truth) "
      "into a folder in the format of the TUM RGB-D benchmark.",
      "dmslam-synth");
  app.SetVersion(dmslam::BuildVersion());
  Arguments args;
  AddOptions(app, args);
  return app.Run(argc, argv, [&] { Run(args); });
}
