#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/synthetic/actor.h"
#include "dmslam/synthetic/camera_path.h"
#include "dmslam/synthetic/prop.h"
#include "dmslam/synthetic/renderer.h"
#include "dmslam/synthetic/scene.h"

namespace dmslam {

struct WorldOptions {
  SceneOptions scene;
  CameraPathOptions path;
  ActorOptions actor;
  PropOptions props;  ///< What moves beside people. `props.door` needs `scene.doorway`.
  int actors = 0;     ///< How many people. With a moving share and 0 here, as many as it takes.
  double moving_share =
      0;  ///< Mean share of the image that people and props cover, 0..0.8; 0 leaves ActorOptions' distances.
  double duration_s = 10;  ///< For so long the people's doings are simulated.
};

/// The camera of config/synthetic.yaml.
Camera SyntheticCamera();

/// A scene, a camera path through it and the people who walk before the camera: all that a sequence shows, at
/// any instant. Everything follows from the options.
class World {
 public:
  /// `camera` is needed to see how much of the image people cover. Throws InputError for options that do not
  /// fit together.
  World(const WorldOptions& options, const Camera& camera);

  const Scene& scene() const { return scene_; }
  const CameraPath& path() const { return path_; }
  int actors() const { return static_cast<int>(timelines_.size()); }
  int props() const { return static_cast<int>(props_.size()); }
  Instant At(double time_s) const;

 private:
  void CastActors(const WorldOptions& options, int actors, double near_m, double far_m);
  void FitMovingShare(const WorldOptions& options, const Camera& camera, int actors);
  double MeasureShare(const Camera& camera, double duration_s) const;

  Scene scene_;
  CameraPath path_;
  std::vector<ActorLook> looks_;
  std::vector<ActorTimeline> timelines_;
  std::vector<std::unique_ptr<const Prop>> props_;
  bool carries_ = false;  ///< The first person carries something.
};

/// One frame of a world, as the camera at `time_s` sees it. Makes a renderer for it: for many frames, keep
/// one.
RenderedFrame RenderFrame(const World& world, const Camera& camera, const RenderOptions& options,
                          double time_s, uint64_t index);

/// The same with a renderer at hand.
RenderedFrame RenderFrame(const World& world, Renderer& renderer, double time_s, uint64_t index);

/// One frame of a still scene from any pose.
RenderedFrame RenderFrame(const Scene& scene, const Rigid3d& T_world_cam, const Camera& camera,
                          const RenderOptions& options, double time_s);

}  // namespace dmslam
