#pragma once

#include <Eigen/Core>
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "dmslam/synthetic/actor.h"
#include "dmslam/synthetic/camera_path.h"
#include "dmslam/synthetic/mesh.h"
#include "dmslam/synthetic/scene.h"

namespace dmslam {

/// Somebody at an instant.
struct Person {
  ActorLook look;
  ActorState state;
};

/// A thing at an instant.
struct PropState {
  Mesh mesh;            ///< In the world.
  bool moving = false;  ///< Whether it, or what it shows, moves.
};

/// A thing that moves and is no person. The same at the same instant, however often it is asked.
class Prop {
 public:
  Prop() = default;
  Prop(const Prop&) = delete;
  Prop& operator=(const Prop&) = delete;
  virtual ~Prop() = default;
  virtual PropState At(double time_s, std::span<const Person> people) const = 0;
};

/// A cardboard box before the chest of the first person.
class CarriedBox : public Prop {
 public:
  CarriedBox(uint64_t seed, int texture_halvings, TextureList& textures);
  PropState At(double time_s, std::span<const Person> people) const override;

 private:
  Mesh box_;  ///< In the carrier's frame; see CarriedFrame.
};

/// A cart as high as a table with parcels on it, that rolls before the camera, stops and rolls on.
class Cart : public Prop {
 public:
  /// `actor` says at what distance from the camera, and its seed where.
  Cart(const Scene& scene, const CameraPath& path, const ActorOptions& actor, double duration_s,
       int texture_halvings, TextureList& textures);
  PropState At(double time_s, std::span<const Person> people) const override;

 private:
  ActorTimeline ways_;
  Mesh cart_;  ///< x to its right, y ahead, z up from the floor.
};

/// A door that opens into the room, stays open, closes and stays closed.
class SwingingDoor : public Prop {
 public:
  SwingingDoor(const Doorway& doorway, uint64_t seed, double duration_s, int texture_halvings,
               TextureList& textures);
  PropState At(double time_s, std::span<const Person> people) const override;
  /// 0 closed; up to 80 degrees.
  double AngleRad(double time_s) const;

 private:
  /// It swings from `begin_s` to `end_s`.
  struct Swing {
    double begin_s, end_s;
    bool opens;
  };
  Doorway doorway_;
  std::vector<Swing> swings_;
  Mesh leaf_;  ///< x along the leaf from the hinge, z up.
};

/// A large screen on a stand that plays: pictures follow each other, and each moves across.
class PlayingScreen : public Prop {
 public:
  PlayingScreen(const Scene& scene, uint64_t seed, double duration_s, int texture_halvings,
                TextureList& textures);
  PropState At(double time_s, std::span<const Person> people) const override;

 private:
  struct Shot {
    double begin_s;
    uint32_t picture;
    Eigen::Vector2f from, per_second;  ///< Texture coordinates of the upper left corner.
  };
  std::vector<Shot> shots_;
  /// What plays: one rectangle, the first of the mesh.
  static constexpr size_t kPlayingVertices = 4, kPlayingTriangles = 2;
  Mesh screen_;  ///< In the world.
};

/// Which props there are.
struct PropOptions {
  bool carried_box = false;
  bool cart = false;
  bool door = false;  ///< Needs a scene with a doorway.
  bool screen = false;
  uint64_t seed = 1;
};

/// Makes them; adds their pictures to `textures`. Throws InputError where a door has no doorway.
std::vector<std::unique_ptr<const Prop>> MakeProps(const PropOptions& options, const Scene& scene,
                                                   const CameraPath& path, const ActorOptions& actor,
                                                   double duration_s, int texture_halvings,
                                                   TextureList& textures);

}  // namespace dmslam
