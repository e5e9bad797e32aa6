#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <span>
#include <vector>

#include "dmslam/camera/camera.h"
#include "dmslam/dataset/image.h"
#include "dmslam/geometry/rigid3.h"
#include "dmslam/synthetic/mesh.h"

namespace dmslam {

struct RenderOptions {
  int samples = 4;  ///< Pictures per frame, each at its own instant and its own place within the pixel.
  double exposure_s = 0.010;  ///< The shutter is open for so long around a frame's stamp.
  double read_noise = 0.7;    ///< Standard deviation of what is added to every pixel, in grey values.
  double shot_noise = 0.09;   ///< Times the root of the grey value: the noise of light itself.
  double vignetting = 0.18;   ///< How much darker the corners are than the middle.
  double gain_swing = 0.03;   ///< Automatic exposure: how much the brightness wanders.
  uint64_t seed = 1;          ///< Of the noise.
  bool depth = true;          ///< Whether RenderedFrame::depth_m is wanted.
};

/// What a rendered frame shows and what is true of it.
struct RenderedFrame {
  ColorImage color;
  GrayImage gray;  ///< Luma of `color`.
  GrayImage mask;  ///< 255 an actor that moves, 128 one that stands still, 0 anything else.
  std::vector<float>
      depth_m;  ///< Along the optical axis, at the frame's stamp, per pixel; 0 where there is nothing.
};

/// A scene at one instant: where the camera is, and what stands before it besides the still meshes.
struct Instant {
  Rigid3d T_world_cam;
  std::vector<Mesh> actors;
  std::vector<bool> moving;  ///< Per actor.
};

/// A software rasteriser on one thread: z-buffered triangles with perspective-correct textures, mip levels
/// chosen per pixel, edges and motion smoothed by averaging several pictures per frame. The camera's
/// distortion is applied by looking up, for every pixel of the distorted image, what lies at its ideal place.
/// Same input, same bytes.
class Renderer {
 public:
  Renderer(const Camera& camera, const RenderOptions& options);
  ~Renderer();
  Renderer(Renderer&&) noexcept;
  Renderer& operator=(Renderer&&) noexcept;

  /// Renders frame `index` at `time_s`; `instant_at` gives the world at the instants of its exposure.
  RenderedFrame Render(std::span<const Mesh> still, const TextureList& textures, double time_s,
                       uint64_t index, const std::function<Instant(double time_s)>& instant_at);

  /// Depth alone, at one instant, of the still meshes and the actors; row by row as in
  /// RenderedFrame::depth_m. `actor_of` gets, per pixel, the actor seen there or -1.
  std::vector<float> RenderDepth(std::span<const Mesh> still, const Instant& instant,
                                 std::vector<int>* actor_of);

 private:
  class Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace dmslam
