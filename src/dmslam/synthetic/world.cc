#include "dmslam/synthetic/world.h"

#include <algorithm>
#include <cmath>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

/// A camera with the same view and a fraction of the pixels, without lens.
Camera Thumbnail(const Camera& camera, int divisor) {
  Camera small = camera.WithoutLens();
  small.width_px = std::max(32, camera.width_px / divisor);
  small.height_px = std::max(32, camera.height_px / divisor);
  const double sx = static_cast<double>(small.width_px) / camera.width_px;
  const double sy = static_cast<double>(small.height_px) / camera.height_px;
  small.fx_px *= sx;
  small.cx_px = (camera.cx_px + 0.5) * sx - 0.5;
  small.fy_px *= sy;
  small.cy_px = (camera.cy_px + 0.5) * sy - 0.5;
  return small;
}

void CheckOptions(const WorldOptions& options) {
  if (!(options.moving_share >= 0 && options.moving_share <= 0.8)) {
    throw InputError("--moving-share: must lie in 0..0.8");
  }
  if (options.actors < 0 || options.actors > 12) throw InputError("--actors: must lie in 0..12");
  if (!(options.duration_s > 0 && options.duration_s < 1e5))
    throw InputError("--frames: the sequence is empty or too long");
}

}  // namespace

Camera SyntheticCamera() {
  return {.width_px = 640, .height_px = 480, .fx_px = 525, .fy_px = 525, .cx_px = 319.5, .cy_px = 239.5};
}

World::World(const WorldOptions& options, const Camera& camera)
    : scene_((CheckOptions(options), BuildScene(options.scene))), path_(scene_, options.path) {
  int actors = options.actors;
  if (options.moving_share > 0 && actors == 0) {
    actors = options.moving_share < 0.15   ? 1
             : options.moving_share < 0.38 ? 2
             : options.moving_share < 0.55 ? 3
                                           : 4;
  }
  for (int i = 0; i < actors; ++i) {
    looks_.push_back(DressActor(options.actor.seed, i, options.scene.texture_halvings, scene_.textures));
  }
  carries_ = options.props.carried_box;
  if (carries_ && actors == 0) throw InputError("--carry: nobody is there to carry; give --actors");
  props_ = MakeProps(options.props, scene_, path_, options.actor, options.duration_s,
                     options.scene.texture_halvings, scene_.textures);
  if (options.moving_share > 0)
    FitMovingShare(options, camera, actors);
  else
    CastActors(options, actors, options.actor.near_m, options.actor.far_m);
}

void World::CastActors(const WorldOptions& options, int actors, double near_m, double far_m) {
  ActorOptions actor = options.actor;
  actor.near_m = near_m;
  actor.far_m = far_m;
  timelines_.clear();
  for (int i = 0; i < actors; ++i) timelines_.emplace_back(scene_, path_, actor, i, options.duration_s);
}

void World::FitMovingShare(const WorldOptions& options, const Camera& camera, int actors) {
  // The nearer they walk, the more they cover: bisection over the distance, on small pictures.
  const Camera small = Thumbnail(camera, 10);
  double near_m = 0.75, far_m = 5.0, best_m = near_m, best_error = 1e9;
  for (int i = 0; i < 8; ++i) {
    const double distance_m = i == 0 ? near_m : std::sqrt(near_m * far_m);
    CastActors(options, actors, 0.85 * distance_m, 1.2 * distance_m);
    const double share = MeasureShare(small, options.duration_s);
    if (std::abs(share - options.moving_share) < best_error) {
      best_error = std::abs(share - options.moving_share);
      best_m = distance_m;
    }
    if (i == 0 && share < options.moving_share) break;  // As near as people come.
    if (i > 0) (share > options.moving_share ? near_m : far_m) = distance_m;
  }
  CastActors(options, actors, 0.85 * best_m, 1.2 * best_m);
}

double World::MeasureShare(const Camera& camera, double duration_s) const {
  Renderer renderer(camera, RenderOptions{});
  const int samples = std::clamp(static_cast<int>(duration_s * 2), 20, 80);
  size_t covered = 0, all = 0;
  for (int i = 0; i < samples; ++i) {
    std::vector<int> actor_of;
    renderer.RenderDepth({}, At(duration_s * (i + 0.5) / samples), &actor_of);
    covered += static_cast<size_t>(
        std::count_if(actor_of.begin(), actor_of.end(), [](int actor) { return actor >= 0; }));
    all += actor_of.size();
  }
  return static_cast<double>(covered) / static_cast<double>(all);
}

Instant World::At(double time_s) const {
  Instant instant;
  instant.T_world_cam = path_.T_world_cam(time_s);
  std::vector<Person> people;
  for (size_t i = 0; i < timelines_.size(); ++i) {
    ActorState state = timelines_[i].At(time_s);
    state.carrying = carries_ && i == 0;
    instant.actors.push_back(BuildActorMesh(looks_[i], state, static_cast<int>(i)));
    instant.moving.push_back(state.moving);
    people.push_back({looks_[i], state});
  }
  for (const auto& prop : props_) {
    PropState state = prop->At(time_s, people);
    state.mesh.actor = static_cast<int>(instant.actors.size());
    instant.actors.push_back(std::move(state.mesh));
    instant.moving.push_back(state.moving);
  }
  return instant;
}

RenderedFrame RenderFrame(const World& world, Renderer& renderer, double time_s, uint64_t index) {
  return renderer.Render(world.scene().meshes, world.scene().textures, time_s, index,
                         [&world](double instant_s) { return world.At(instant_s); });
}

RenderedFrame RenderFrame(const World& world, const Camera& camera, const RenderOptions& options,
                          double time_s, uint64_t index) {
  Renderer renderer(camera, options);
  return RenderFrame(world, renderer, time_s, index);
}

RenderedFrame RenderFrame(const Scene& scene, const Rigid3d& T_world_cam, const Camera& camera,
                          const RenderOptions& options, double time_s) {
  Renderer renderer(camera, options);
  return renderer.Render(scene.meshes, scene.textures, time_s,
                         static_cast<uint64_t>(std::llround(time_s * 1e6)), [&T_world_cam](double) {
                           return Instant{T_world_cam, {}, {}};
                         });
}

}  // namespace dmslam
