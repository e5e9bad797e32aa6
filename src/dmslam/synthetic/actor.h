#pragma once

#include <Eigen/Core>
#include <Eigen/Geometry>
#include <cstdint>
#include <string>
#include <vector>

#include "dmslam/synthetic/camera_path.h"
#include "dmslam/synthetic/mesh.h"
#include "dmslam/synthetic/scene.h"
#include "dmslam/util/random.h"

namespace dmslam {

enum class Behaviour {
  kWalk,       ///< Always on the move.
  kStopAndGo,  ///< Walks for 2 to 4 s, stands for 1.5 to 3 s.
  kSit,        ///< Walks to a chair, sits for 3 to 6 s, gets up and walks on; where there is no chair, as
               ///< kStopAndGo.
};

/// "walk", "stop-and-go" or "sit"; throws InputError for another name.
Behaviour ParseBehaviour(const std::string& name);

struct ActorOptions {
  Behaviour behaviour = Behaviour::kWalk;
  uint64_t seed = 1;
  double near_m = 1.1;  ///< Walkers keep between these distances before the camera.
  double far_m = 1.6;
  double stand_first_s = 0;  ///< They stand still for so long, then behave.
};

/// A person at one instant.
struct ActorState {
  Eigen::Vector2d position{0, 0};
  double heading_rad = 0;
  double gait_rad = 0;    ///< Phase of the steps.
  double stride = 0;      ///< How far arms and legs swing, 0 standing .. 1 walking.
  double sitting = 0;     ///< 0 upright .. 1 seated.
  bool moving = false;    ///< Whether any part of the body moves.
  bool carrying = false;  ///< Both arms hold something before the chest.
};

/// A person's doings over a sequence, simulated once in small steps so that any instant can be asked for.
class ActorTimeline {
 public:
  /// Walks within view of `path` in `scene` for `duration_s`. `index` tells several actors apart.
  ActorTimeline(const Scene& scene, const CameraPath& path, const ActorOptions& options, int index,
                double duration_s);

  ActorState At(double time_s) const;

 private:
  std::vector<ActorState> samples_;
};

/// How a person is built and dressed.
struct ActorLook {
  double height_m = 1.75;
  double width = 1.0;                                                         ///< Stoutness, 1 = average.
  uint32_t shirt = 0, trousers = 0, skin = 0, face = 0, hair = 0, shoes = 0;  ///< Textures.
};

/// Dresses a person; adds its clothes to the scene's textures.
ActorLook DressActor(uint64_t seed, int index, int texture_halvings, TextureList& textures);

/// The place between the hands of somebody who carries: x to his right, y ahead of him, z up.
Eigen::Affine3f CarriedFrame(const ActorLook& look, const ActorState& state);

/// The body at one instant, as one mesh that belongs to actor `index`.
Mesh BuildActorMesh(const ActorLook& look, const ActorState& state, int index);

}  // namespace dmslam
