#include "dmslam/synthetic/renderer.h"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <limits>
#include <optional>

#include "dmslam/util/check.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

using Eigen::Vector3d;
using Eigen::Vector3f;

constexpr float kNearM = 0.06f;
constexpr uint32_t kNothing = std::numeric_limits<uint32_t>::max();

/// A value that changes linearly over the canvas: value = a x + b y + c.
struct Plane {
  float a = 0, b = 0, c = 0;
  float At(float x, float y) const { return a * x + b * y + c; }
};

/// A triangle as seen: everything over z is linear in the image.
struct Facet {
  Plane inverse_depth, u_over_z, v_over_z, light_over_z;
  const Texture* texture = nullptr;
  int actor = -1;
};

/// Log2 of a positive number to about 0.01, from the exponent and a parabola over the mantissa.
float FastLog2(float value) {
  const auto bits = std::bit_cast<uint32_t>(value);
  const float exponent = static_cast<float>(static_cast<int>(bits >> 23) - 127);
  const float mantissa = std::bit_cast<float>((bits & 0x007fffffu) | 0x3f800000u);
  return exponent + (-0.34484843f * mantissa + 2.02466578f) * mantissa - 1.67487759f;
}

float Fraction(float value) { return value - std::floor(value); }

/// Standard normal numbers by lookup: quick and the same everywhere.
class NoiseTable {
 public:
  NoiseTable() {
    Random random(0x5eed);
    for (float& value : values_) value = static_cast<float>(random.Gaussian());
  }
  float operator[](uint32_t index) const { return values_[index & (kSize - 1)]; }

 private:
  static constexpr uint32_t kSize = 1u << 15;
  std::array<float, kSize> values_{};
};

}  // namespace

/// The buffers and steps behind Renderer. The canvas is the ideal image: for a camera without distortion the
/// image itself, otherwise as much of the ideal plane as the distorted image shows, twice as fine.
class Renderer::Impl {
 public:
  Impl(const Camera& camera, const RenderOptions& options);

  RenderedFrame Render(std::span<const Mesh> still, const TextureList& textures, double time_s,
                       uint64_t index, const std::function<Instant(double)>& instant_at);
  std::vector<float> RenderDepth(std::span<const Mesh> still, const Instant& instant,
                                 std::vector<int>* actor_of);

 private:
  /// The pixels of the canvas that a triangle may touch.
  struct Extent {
    int x_low = 0, x_high = 0, y_low = 0, y_high = 0;
  };

  void MakeLookup();
  bool IsVisible(const Eigen::AlignedBox3f& bounds, const Rigid3d& T_cam_world) const;
  void Rasterize(std::span<const Mesh> still, const Instant& instant, const TextureList* textures,
                 const Eigen::Vector2d& jitter_px);
  void AddMesh(const Mesh& mesh, const Rigid3d& T_cam_world, const TextureList* textures,
               const Pinhole& canvas);
  void AddTriangle(const std::array<const Vertex*, 3>& corners, const std::array<Vector3f, 3>& p_cam,
                   const Texture* texture, int actor, const Pinhole& canvas);
  std::optional<Extent> ExtentOf(const std::array<Vector3f, 3>& p_cam, const Pinhole& canvas) const;
  void FillSpans(const std::array<Plane, 3>& edges, const Plane& inverse_depth, const Extent& extent,
                 uint32_t facet);
  void Shade(float level_bias);
  int MipLevel(const Facet& facet, float x, float y, float bias) const;
  const Facet* FacetAt(size_t pixel, float& x, float& y) const;
  void Develop(double time_s, uint64_t index, RenderedFrame& frame);
  void MakeMask(const std::vector<bool>& moving, GrayImage& mask) const;

  Camera camera_;
  RenderOptions options_;
  double canvas_scale_ = 1;
  Eigen::Vector2d canvas_origin_px_{0, 0};
  int canvas_width_ = 0, canvas_height_ = 0;
  std::vector<Eigen::Vector2f> lookup_;  ///< Canvas position per pixel; empty where it is the pixel itself.
  /// Added to a canvas position before it is cut down to whole pixels; 0.5 rounds. The samples of a frame
  /// take it evenly from 0..1, so that edges of things are on average where they belong.
  Eigen::Vector2f canvas_dither_{0.5f, 0.5f};
  std::vector<float> vignette_;
  std::vector<float> z_buffer_;  ///< Inverse depth.
  std::vector<uint32_t> facet_of_;
  std::vector<Facet> facets_;
  std::vector<Vector3f> p_cam_;
  std::vector<uint16_t> sum_;           ///< Red, green, blue over the samples.
  std::vector<uint8_t> actor_samples_;  ///< How many samples show an actor.
  std::vector<int8_t> last_actor_;
  NoiseTable noise_;
};

Renderer::Impl::Impl(const Camera& camera, const RenderOptions& options)
    : camera_(camera), options_(options) {
  DMSLAM_CHECK(options.samples >= 1 && options.samples <= 64, "one to 64 samples per frame");
  MakeLookup();
  const size_t canvas = static_cast<size_t>(canvas_width_) * static_cast<size_t>(canvas_height_);
  z_buffer_.resize(canvas);
  facet_of_.resize(canvas);
  const auto w = static_cast<float>(camera.width_px), h = static_cast<float>(camera.height_px);
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const float dx = (static_cast<float>(x) - 0.5f * w) / (0.5f * w),
                  dy = (static_cast<float>(y) - 0.5f * h) / (0.5f * w);
      vignette_.push_back(1.0f - static_cast<float>(options.vignetting) * (dx * dx + dy * dy) * 0.64f);
    }
  }
}

void Renderer::Impl::MakeLookup() {
  canvas_width_ = camera_.width_px;
  canvas_height_ = camera_.height_px;
  if (!camera_.HasDistortion()) return;
  std::vector<Eigen::Vector2d> ideal;
  Eigen::AlignedBox2d bounds;
  for (int y = 0; y < camera_.height_px; ++y) {
    for (int x = 0; x < camera_.width_px; ++x) {
      const auto place = camera_.Undistort({x, y});
      ideal.push_back(place.value_or(Eigen::Vector2d::Constant(std::nan(""))));
      if (place) bounds.extend(*place);
    }
  }
  canvas_scale_ = 2.0;
  canvas_origin_px_ = bounds.min() - Eigen::Vector2d::Constant(2.0);
  const Eigen::Vector2d size = canvas_scale_ * (bounds.sizes() + Eigen::Vector2d::Constant(4.0));
  DMSLAM_CHECK(size.maxCoeff() < 16384, "the distortion spreads the image too far");
  canvas_width_ = static_cast<int>(std::ceil(size.x())) + 1;
  canvas_height_ = static_cast<int>(std::ceil(size.y())) + 1;
  for (const Eigen::Vector2d& place : ideal) {
    lookup_.push_back((canvas_scale_ * (place - canvas_origin_px_)).cast<float>());
  }
}

bool Renderer::Impl::IsVisible(const Eigen::AlignedBox3f& bounds, const Rigid3d& T_cam_world) const {
  // Outside of one of the frustum's planes with all eight corners, or not.
  const double left = (canvas_origin_px_.x() - 2 - camera_.cx_px) / camera_.fx_px;
  const double top = (canvas_origin_px_.y() - 2 - camera_.cy_px) / camera_.fy_px;
  const double right =
      (canvas_origin_px_.x() + canvas_width_ / canvas_scale_ + 2 - camera_.cx_px) / camera_.fx_px;
  const double bottom =
      (canvas_origin_px_.y() + canvas_height_ / canvas_scale_ + 2 - camera_.cy_px) / camera_.fy_px;
  std::array<int, 5> outside{};
  for (int i = 0; i < 8; ++i) {
    const auto corner = bounds.corner(static_cast<Eigen::AlignedBox3f::CornerType>(i));
    const Vector3d p = T_cam_world * corner.cast<double>();
    outside[0] += p.z() < kNearM;
    outside[1] += p.x() < left * p.z();
    outside[2] += p.x() > right * p.z();
    outside[3] += p.y() < top * p.z();
    outside[4] += p.y() > bottom * p.z();
  }
  return std::none_of(outside.begin(), outside.end(), [](int count) { return count == 8; });
}

void Renderer::Impl::Rasterize(std::span<const Mesh> still, const Instant& instant,
                               const TextureList* textures, const Eigen::Vector2d& jitter_px) {
  const Pinhole canvas{canvas_scale_ * camera_.fx_px, canvas_scale_ * camera_.fy_px,
                       canvas_scale_ * (camera_.cx_px - canvas_origin_px_.x() - jitter_px.x()),
                       canvas_scale_ * (camera_.cy_px - canvas_origin_px_.y() - jitter_px.y())};
  std::fill(z_buffer_.begin(), z_buffer_.end(), 0.0f);
  std::fill(facet_of_.begin(), facet_of_.end(), kNothing);
  facets_.clear();
  const Rigid3d T_cam_world = instant.T_world_cam.Inverse();
  // What moves is mostly near: drawn first, it hides what lies behind.
  for (const Mesh& mesh : instant.actors) AddMesh(mesh, T_cam_world, textures, canvas);
  for (const Mesh& mesh : still) AddMesh(mesh, T_cam_world, textures, canvas);
}

void Renderer::Impl::AddMesh(const Mesh& mesh, const Rigid3d& T_cam_world, const TextureList* textures,
                             const Pinhole& canvas) {
  if (!IsVisible(mesh.bounds, T_cam_world)) return;
  const Eigen::Matrix3f R = T_cam_world.rotation.toRotationMatrix().cast<float>();
  const Vector3f t = T_cam_world.translation.cast<float>();
  p_cam_.clear();
  for (const Vertex& vertex : mesh.vertices) p_cam_.push_back(R * vertex.position + t);
  for (const Triangle& triangle : mesh.triangles) {
    const auto [a, b, c] = triangle.corners;
    const Texture* texture = textures != nullptr ? (*textures)[triangle.texture].get() : nullptr;
    AddTriangle({&mesh.vertices[a], &mesh.vertices[b], &mesh.vertices[c]}, {p_cam_[a], p_cam_[b], p_cam_[c]},
                texture, mesh.actor, canvas);
  }
}

std::optional<Renderer::Impl::Extent> Renderer::Impl::ExtentOf(const std::array<Vector3f, 3>& p_cam,
                                                               const Pinhole& canvas) const {
  if (std::max({p_cam[0].z(), p_cam[1].z(), p_cam[2].z()}) < kNearM) return std::nullopt;
  Extent extent{0, canvas_width_ - 1, 0, canvas_height_ - 1};
  if (std::min({p_cam[0].z(), p_cam[1].z(), p_cam[2].z()}) <= kNearM) return extent;
  double x0 = 1e9, x1 = -1e9, y0 = 1e9, y1 = -1e9;
  for (const Vector3f& p : p_cam) {
    const double x = canvas.fx_px * p.x() / p.z() + canvas.cx_px,
                 y = canvas.fy_px * p.y() / p.z() + canvas.cy_px;
    x0 = std::min(x0, x);
    x1 = std::max(x1, x);
    y0 = std::min(y0, y);
    y1 = std::max(y1, y);
  }
  if (x1 < 0 || y1 < 0 || x0 > extent.x_high || y0 > extent.y_high) return std::nullopt;
  extent.x_low = std::max(extent.x_low, static_cast<int>(std::ceil(std::max(x0, 0.0))));
  extent.y_low = std::max(extent.y_low, static_cast<int>(std::ceil(std::max(y0, 0.0))));
  extent.x_high = static_cast<int>(std::floor(std::min<double>(x1, extent.x_high)));
  extent.y_high = static_cast<int>(std::floor(std::min<double>(y1, extent.y_high)));
  if (extent.x_low > extent.x_high || extent.y_low > extent.y_high) return std::nullopt;
  return extent;
}

// Homogeneous rasterisation (Olano and Greer, "Triangle scan conversion using 2D homogeneous coordinates",
// 1997): with the rows p0, p1, p2 of a matrix P and the ray r of a pixel, the barycentric coordinates over z
// are P^-T r, linear in the pixel. Nothing has to be clipped.
void Renderer::Impl::AddTriangle(const std::array<const Vertex*, 3>& corners,
                                 const std::array<Vector3f, 3>& p_cam, const Texture* texture, int actor,
                                 const Pinhole& canvas) {
  const std::optional<Extent> extent = ExtentOf(p_cam, canvas);
  if (!extent) return;
  const Vector3d p0 = p_cam[0].cast<double>(), p1 = p_cam[1].cast<double>(), p2 = p_cam[2].cast<double>();
  const Vector3d n0 = p1.cross(p2), n1 = p2.cross(p0), n2 = p0.cross(p1);
  const double determinant = p0.dot(n0);
  if (std::abs(determinant) < 1e-12) return;
  const auto plane = [&](const Vector3d& gradient) {
    // gradient . ((x - cx) / fx, (y - cy) / fy, 1), as a function of the canvas position.
    const double a = gradient.x() / canvas.fx_px, b = gradient.y() / canvas.fy_px;
    return Plane{static_cast<float>(a), static_cast<float>(b),
                 static_cast<float>(gradient.z() - a * canvas.cx_px - b * canvas.cy_px)};
  };
  const Vector3d g0 = n0 / determinant, g1 = n1 / determinant, g2 = n2 / determinant;
  Facet facet;
  facet.inverse_depth = plane(g0 + g1 + g2);
  facet.actor = actor;
  if (texture != nullptr) {
    const auto blend = [&](double v0, double v1, double v2) { return plane(v0 * g0 + v1 * g1 + v2 * g2); };
    const double w = texture->width(), h = texture->height();
    facet.texture = texture;
    facet.u_over_z = blend(w * corners[0]->u, w * corners[1]->u, w * corners[2]->u);
    facet.v_over_z = blend(h * corners[0]->v, h * corners[1]->v, h * corners[2]->v);
    facet.light_over_z = blend(corners[0]->light, corners[1]->light, corners[2]->light);
  }
  facets_.push_back(facet);
  FillSpans({plane(g0), plane(g1), plane(g2)}, facet.inverse_depth, *extent,
            static_cast<uint32_t>(facets_.size() - 1));
}

void Renderer::Impl::FillSpans(const std::array<Plane, 3>& edges, const Plane& inverse_depth,
                               const Extent& extent, uint32_t facet) {
  // The pixels of a row where all edge functions and the inverse depth's limits hold form one interval. An
  // edge may miss its neighbour by a rounding error: a tiny slack closes the seam.
  const Plane limits[4] = {
      edges[0], edges[1], edges[2], {-inverse_depth.a, -inverse_depth.b, 1.0f / kNearM - inverse_depth.c}};
  for (int y = extent.y_low; y <= extent.y_high; ++y) {
    const auto fy = static_cast<float>(y);
    auto from = static_cast<float>(extent.x_low), to = static_cast<float>(extent.x_high);
    for (const Plane& limit : limits) {
      const float at_zero = limit.b * fy + limit.c;
      if (limit.a > 0)
        from = std::max(from, -at_zero / limit.a - 1e-3f);
      else if (limit.a < 0)
        to = std::min(to, -at_zero / limit.a + 1e-3f);
      else if (at_zero < 0)
        to = -1;
    }
    if (!(from <= to)) continue;
    const int first = static_cast<int>(std::ceil(from)), last = static_cast<int>(to);
    const size_t row = static_cast<size_t>(y) * static_cast<size_t>(canvas_width_);
    float* z = z_buffer_.data() + row;
    uint32_t* ids = facet_of_.data() + row;
    const float base = inverse_depth.b * fy + inverse_depth.c, step = inverse_depth.a;
    for (int x = first; x <= last; ++x) {
      const float value = base + step * static_cast<float>(x);
      const bool nearer = value > z[x];
      z[x] = nearer ? value : z[x];
      ids[x] = nearer ? facet : ids[x];
    }
  }
}

const Facet* Renderer::Impl::FacetAt(size_t pixel, float& x, float& y) const {
  size_t at = pixel;
  if (!lookup_.empty()) {
    x = lookup_[pixel].x();
    y = lookup_[pixel].y();
    if (!(x >= 0 && y >= 0)) return nullptr;
    at = static_cast<size_t>(y + canvas_dither_.y()) * static_cast<size_t>(canvas_width_) +
         static_cast<size_t>(x + canvas_dither_.x());
  }
  const uint32_t facet = facet_of_[at];
  return facet == kNothing ? nullptr : &facets_[facet];
}

int Renderer::Impl::MipLevel(const Facet& facet, float x, float y, float bias) const {
  const float z = 1.0f / std::max(facet.inverse_depth.At(x, y), 1e-4f);
  const float u = z * facet.u_over_z.At(x, y), v = z * facet.v_over_z.At(x, y);
  // How far one steps over the texture with one pixel, along x and along y.
  const Plane &w = facet.inverse_depth, &s = facet.u_over_z, &t = facet.v_over_z;
  const float du_dx = z * (s.a - u * w.a), dv_dx = z * (t.a - v * w.a);
  const float du_dy = z * (s.b - u * w.b), dv_dy = z * (t.b - v * w.b);
  const float along_x = du_dx * du_dx + dv_dx * dv_dx, along_y = du_dy * du_dy + dv_dy * dv_dy;
  // At a grazing view the longer step would blur the shorter one away; the samples within a pixel cover some
  // of it.
  const float longer = std::max(along_x, along_y), shorter = std::min(along_x, along_y);
  const auto per_pixel = static_cast<float>(canvas_scale_ * canvas_scale_);
  const float squared = per_pixel * std::max(shorter, longer * (1.0f / 6.0f));
  if (!(squared > 1.0f)) return 0;
  return std::clamp(static_cast<int>(0.5f * FastLog2(squared) + bias), 0, facet.texture->levels() - 1);
}

void Renderer::Impl::Shade(float level_bias) {
  constexpr int kLevelRun = 8;  // The mip level is worked out once for so many pixels of a facet.
  size_t pixel = 0;
  for (int y = 0; y < camera_.height_px; ++y) {
    const Facet* last = nullptr;
    int level = 0;
    for (int x = 0; x < camera_.width_px; ++x, ++pixel) {
      float at_x = static_cast<float>(x), at_y = static_cast<float>(y);
      const Facet* facet = FacetAt(pixel, at_x, at_y);
      if (facet == nullptr) continue;
      if (facet != last || x % kLevelRun == 0) level = MipLevel(*facet, at_x, at_y, level_bias);
      last = facet;
      const float z = 1.0f / std::max(facet->inverse_depth.At(at_x, at_y), 1e-4f);
      const uint32_t texel = facet->texture->Sample(z * facet->u_over_z.At(at_x, at_y),
                                                    z * facet->v_over_z.At(at_x, at_y), level);
      const auto light =
          static_cast<uint32_t>(std::clamp(z * facet->light_over_z.At(at_x, at_y), 0.0f, 1.5f) * 256.0f);
      for (size_t k = 0; k < 3; ++k) {
        const uint32_t lit = std::min<uint32_t>(255, (((texel >> (8 * k)) & 0xff) * light) >> 8);
        sum_[3 * pixel + k] = static_cast<uint16_t>(sum_[3 * pixel + k] + lit);
      }
      if (facet->actor >= 0) {
        ++actor_samples_[pixel];
        last_actor_[pixel] = static_cast<int8_t>(facet->actor);
      }
    }
  }
}

void Renderer::Impl::Develop(double time_s, uint64_t index, RenderedFrame& frame) {
  const size_t pixels = vignette_.size();
  frame.color = {camera_.width_px, camera_.height_px, std::vector<uint8_t>(3 * pixels)};
  frame.gray = GrayImage(camera_.width_px, camera_.height_px);
  const auto phase = static_cast<double>(options_.seed % 1000);
  const double gain = 1.0 + options_.gain_swing * (0.6 * std::sin(0.7 * time_s + phase) +
                                                   0.4 * std::sin(1.9 * time_s + 2 * phase));
  const float scale = static_cast<float>(gain) / static_cast<float>(options_.samples);
  const auto read = static_cast<float>(options_.read_noise), shot = static_cast<float>(options_.shot_noise);
  Random random(DeriveSeed(options_.seed, index, "noise"));
  for (size_t i = 0; i < pixels; ++i) {
    const uint64_t bits = random.Next();
    const float gray_noise = noise_[static_cast<uint32_t>(bits)];
    std::array<uint32_t, 3> rgb{};
    for (size_t k = 0; k < 3; ++k) {
      const float value = static_cast<float>(sum_[3 * i + k]) * scale * vignette_[i];
      // Most of the noise is common to the colours, as after a sensor's demosaicing.
      const float own = noise_[static_cast<uint32_t>(bits >> (16 + 15 * k))];
      const float noise = (read + shot * std::sqrt(value)) * (0.85f * gray_noise + 0.5f * own);
      rgb[k] = static_cast<uint32_t>(std::clamp(value + noise + 0.5f, 0.0f, 255.0f));
      frame.color.data[3 * i + k] = static_cast<uint8_t>(rgb[k]);
    }
    frame.gray.data[i] =
        static_cast<uint8_t>((19595u * rgb[0] + 38470u * rgb[1] + 7471u * rgb[2] + 32768u) >> 16);
  }
}

void Renderer::Impl::MakeMask(const std::vector<bool>& moving, GrayImage& mask) const {
  mask = GrayImage(camera_.width_px, camera_.height_px);
  for (size_t i = 0; i < mask.data.size(); ++i) {
    if (2 * actor_samples_[i] < options_.samples || actor_samples_[i] == 0) continue;
    mask.data[i] = moving[static_cast<size_t>(last_actor_[i])] ? 255 : 128;
  }
}

RenderedFrame Renderer::Impl::Render(std::span<const Mesh> still, const TextureList& textures, double time_s,
                                     uint64_t index, const std::function<Instant(double)>& instant_at) {
  const size_t pixels = vignette_.size();
  sum_.assign(3 * pixels, 0);
  actor_samples_.assign(pixels, 0);
  last_actor_.assign(pixels, -1);
  for (int i = 0; i < options_.samples; ++i) {
    const double t = (i + 0.5) / options_.samples;
    // Places within the pixel by the golden ratio: even over any number of samples.
    const double px = t - 0.5, py = (i + 0.5) * 0.6180339887 - std::floor((i + 0.5) * 0.6180339887) - 0.5;
    const Eigen::Vector2d jitter_px =
        options_.samples == 1 ? Eigen::Vector2d(0, 0) : Eigen::Vector2d(1.4 * px, 1.4 * py);
    Rasterize(still, instant_at(time_s + (t - 0.5) * options_.exposure_s), &textures, jitter_px);
    canvas_dither_ = {Fraction(0.5f + 0.7548777f * static_cast<float>(i)),
                      Fraction(0.5f + 0.5698403f * static_cast<float>(i))};
    // The samples round the mip level at different thresholds: their mean lies between two levels.
    Shade(static_cast<float>(t) - 0.35f);
  }
  RenderedFrame frame;
  Develop(time_s, index, frame);
  const Instant middle = instant_at(time_s);
  MakeMask(middle.moving, frame.mask);
  if (options_.depth) frame.depth_m = RenderDepth(still, middle, nullptr);
  return frame;
}

std::vector<float> Renderer::Impl::RenderDepth(std::span<const Mesh> still, const Instant& instant,
                                               std::vector<int>* actor_of) {
  Rasterize(still, instant, nullptr, {0, 0});
  canvas_dither_ = {0.5f, 0.5f};
  const size_t pixels = vignette_.size();
  std::vector<float> depth_m(pixels, 0.0f);
  if (actor_of != nullptr) actor_of->assign(pixels, -1);
  for (size_t i = 0; i < pixels; ++i) {
    const auto width = static_cast<size_t>(camera_.width_px);
    float x = static_cast<float>(i % width), y = static_cast<float>(i / width);
    const Facet* facet = FacetAt(i, x, y);
    if (facet == nullptr) continue;
    depth_m[i] = 1.0f / facet->inverse_depth.At(x, y);
    if (actor_of != nullptr) (*actor_of)[i] = facet->actor;
  }
  return depth_m;
}

Renderer::Renderer(const Camera& camera, const RenderOptions& options)
    : impl_(std::make_unique<Impl>(camera, options)) {}
Renderer::~Renderer() = default;
Renderer::Renderer(Renderer&&) noexcept = default;
Renderer& Renderer::operator=(Renderer&&) noexcept = default;

RenderedFrame Renderer::Render(std::span<const Mesh> still, const TextureList& textures, double time_s,
                               uint64_t index, const std::function<Instant(double)>& instant_at) {
  return impl_->Render(still, textures, time_s, index, instant_at);
}

std::vector<float> Renderer::RenderDepth(std::span<const Mesh> still, const Instant& instant,
                                         std::vector<int>* actor_of) {
  return impl_->RenderDepth(still, instant, actor_of);
}

}  // namespace dmslam
