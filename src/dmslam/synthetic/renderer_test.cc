#include "dmslam/synthetic/renderer.h"

#include <gtest/gtest.h>

#include <cmath>

#include "dmslam/synthetic/world.h"

namespace dmslam {
namespace {

Camera SmallCamera() {
  return {.width_px = 320, .height_px = 240, .fx_px = 262.5, .fy_px = 262.5, .cx_px = 159.5, .cy_px = 119.5};
}

Camera DistortedCamera() {
  // freiburg1's lens at half the resolution.
  return {.width_px = 320,
          .height_px = 240,
          .fx_px = 258.65,
          .fy_px = 258.23,
          .cx_px = 159.07,
          .cy_px = 127.4,
          .k1 = 0.262383,
          .k2 = -0.953104,
          .p1 = -0.005358,
          .p2 = 0.002628,
          .k3 = 1.163314};
}

RenderOptions Clean() {
  RenderOptions options;
  options.read_noise = options.shot_noise = options.vignetting = options.gain_swing = 0;
  return options;
}

/// Squares of 4 cm, white, on a black wall at z = `depth`, in the camera's own axes.
struct Board {
  TextureList textures;
  std::vector<Mesh> meshes;
};

void AddQuad(Mesh& mesh, const Eigen::Vector3f& center, float half, uint32_t texture) {
  const auto first = static_cast<uint32_t>(mesh.vertices.size());
  for (const auto& [x, y] : {std::pair{-half, -half}, {half, -half}, {-half, half}, {half, half}}) {
    mesh.vertices.push_back(
        {center + Eigen::Vector3f(x, y, 0), x > 0 ? 1.0f : 0.0f, y > 0 ? 1.0f : 0.0f, 1.0f});
  }
  mesh.triangles.push_back({{first, first + 1, first + 2}, texture});
  mesh.triangles.push_back({{first + 1, first + 3, first + 2}, texture});
}

Board MakeBoard(const std::vector<Eigen::Vector3f>& centers, float half) {
  Board board;
  board.textures = {std::make_shared<const Texture>(Canvas(4, 4, Rgb::Constant(0))),
                    std::make_shared<const Texture>(Canvas(4, 4, Rgb::Constant(240)))};
  Mesh mesh;
  AddQuad(mesh, {0, 0, 3.0f}, 6.0f, 0);
  for (const Eigen::Vector3f& center : centers) AddQuad(mesh, center, half, 1);
  mesh.UpdateBounds();
  board.meshes.push_back(mesh);
  return board;
}

Instant Still(const Rigid3d& T_world_cam = {}) { return {T_world_cam, {}, {}}; }

/// Centre of brightness within `radius` of a pixel.
Eigen::Vector2d BrightCenter(const GrayImage& image, const Eigen::Vector2d& around, int radius) {
  Eigen::Vector2d sum(0, 0);
  double weight = 0;
  for (int y = static_cast<int>(around.y()) - radius; y <= static_cast<int>(around.y()) + radius; ++y) {
    for (int x = static_cast<int>(around.x()) - radius; x <= static_cast<int>(around.x()) + radius; ++x) {
      if (x < 0 || y < 0 || x >= image.width || y >= image.height) continue;
      sum += image.at(x, y) * Eigen::Vector2d(x, y);
      weight += image.at(x, y);
    }
  }
  return sum / weight;
}

TEST(Renderer, PointsLandWhereTheCameraProjectsThem) {
  for (const Camera& camera : {SmallCamera(), DistortedCamera()}) {
    std::vector<Eigen::Vector3f> centers;
    for (const float x : {-1.1f, -0.4f, 0.3f, 1.05f}) {
      for (const float y : {-0.8f, 0.1f, 0.65f}) centers.emplace_back(x, y, 2.5f);
    }
    const Board board = MakeBoard(centers, 0.02f);
    RenderOptions options = Clean();
    options.samples = 32;
    Renderer renderer(camera, options);
    const RenderedFrame frame =
        renderer.Render(board.meshes, board.textures, 0, 0, [](double) { return Still(); });
    double largest_shift = 0;
    for (const Eigen::Vector3f& center : centers) {
      const Eigen::Vector2d ideal = *camera.Project(center.cast<double>()), raw = camera.Distort(ideal);
      largest_shift = std::max(largest_shift, (raw - ideal).norm());
      EXPECT_LT((BrightCenter(frame.gray, raw, 7) - raw).norm(), 0.12) << center.transpose();
    }
    EXPECT_EQ(largest_shift > 2.0, camera.HasDistortion());  // The lens really does something here.
  }
}

TEST(Renderer, DepthIsExactAndPosesAreHonoured) {
  const Board board = MakeBoard({{0, 0, 2.0f}}, 0.3f);
  const Camera camera = SmallCamera();
  const Rigid3d T_world_cam(ExpSo3({0.05, -0.1, 0.2}), {0.1, 0.05, 0.3});
  Renderer renderer(camera, Clean());
  std::vector<int> actor_of;
  const std::vector<float> depth_m = renderer.RenderDepth(board.meshes, Still(T_world_cam), &actor_of);
  int near = 0, far = 0;
  for (int y = 0; y < camera.height_px; ++y) {
    for (int x = 0; x < camera.width_px; ++x) {
      const auto i = static_cast<size_t>(y * camera.width_px + x);
      const Eigen::Vector3d p_world = T_world_cam * (depth_m[i] * camera.Ray({x, y}));
      const bool on_square = std::abs(p_world.z() - 2.0) < 1e-4;
      ASSERT_TRUE(on_square || std::abs(p_world.z() - 3.0) < 1e-4) << p_world.transpose();
      ASSERT_EQ(actor_of[i], -1);
      (on_square ? near : far) += 1;
      ASSERT_TRUE(!on_square || p_world.head<2>().cwiseAbs().maxCoeff() < 0.301);
    }
  }
  EXPECT_GT(near, 1000);
  EXPECT_GT(far, 1000);
}

TEST(Renderer, SurfacesThatPassBesideTheCameraAreDrawn) {
  // A floor from behind the camera to far ahead: its near edge is never clipped away.
  Board board = MakeBoard({}, 0.1f);
  Mesh floor;
  floor.vertices = {
      {{-5, 1, -5}, 0, 0, 1}, {{5, 1, -5}, 1, 0, 1}, {{-5, 1, 2.9f}, 0, 1, 1}, {{5, 1, 2.9f}, 1, 1, 1}};
  floor.triangles = {{{0, 1, 2}, 1}, {{1, 3, 2}, 1}};
  floor.UpdateBounds();
  board.meshes.push_back(floor);
  const Camera camera = SmallCamera();
  Renderer renderer(camera, Clean());
  const std::vector<float> depth_m = renderer.RenderDepth(board.meshes, Still(), nullptr);
  for (int x = 0; x < camera.width_px; ++x) {
    const float expected = static_cast<float>(camera.fy_px / (camera.height_px - 1 - camera.cy_px));
    ASSERT_NEAR(depth_m[static_cast<size_t>((camera.height_px - 1) * camera.width_px + x)], expected, 1e-3);
  }
}

TEST(Renderer, MotionDuringTheExposureBlurs) {
  const Board board = MakeBoard({{0, 0, 2.5f}}, 0.2f);
  RenderOptions options = Clean();
  options.samples = 8;
  const auto moving = [](double t) { return Still({Eigen::Quaterniond::Identity(), {4.0 * t, 0, 0}}); };
  const auto grey_columns = [&](const std::function<Instant(double)>& instant_at) {
    Renderer renderer(SmallCamera(), options);
    const GrayImage image = renderer.Render(board.meshes, board.textures, 0, 0, instant_at).gray;
    int count = 0;
    for (int x = 0; x < image.width; ++x) count += image.at(x, 119) > 20 && image.at(x, 119) < 220;
    return count;
  };
  EXPECT_GE(grey_columns(moving), grey_columns([](double) { return Still(); }) + 4);
}

TEST(Renderer, ActorsAreMaskedByWhetherTheyMove) {
  WorldOptions options;
  options.scene.texture_halvings = 4;
  options.actors = 2;
  options.duration_s = 3;
  options.actor.stand_first_s = 1.5;
  const World world(options, SmallCamera());
  Renderer renderer(SmallCamera(), RenderOptions{});
  const RenderedFrame standing = RenderFrame(world, renderer, 0.5, 15),
                      walking = RenderFrame(world, renderer, 2.5, 75);
  const auto count = [](const GrayImage& mask, int value) {
    return std::count(mask.data.begin(), mask.data.end(), static_cast<uint8_t>(value));
  };
  EXPECT_GT(count(standing.mask, 128), 1000);
  EXPECT_EQ(count(standing.mask, 255), 0);
  EXPECT_GT(count(walking.mask, 255), 1000);
  EXPECT_EQ(count(walking.mask, 128), 0);
  // Whoever is masked stands before the room: nearer than the far wall.
  int masked = 0, near = 0;
  for (size_t i = 0; i < walking.mask.data.size(); ++i) {
    masked += walking.mask.data[i] == 255;
    near += walking.mask.data[i] == 255 && walking.depth_m[i] < 1.9f;
  }
  EXPECT_GT(near, masked * 97 / 100);  // Borders of limbs in motion belong to both.
}

TEST(Renderer, SameSeedSameBytes) {
  WorldOptions options;
  options.scene.texture_halvings = 3;
  options.actors = 1;
  const World first(options, SmallCamera()), second(options, SmallCamera());
  const RenderedFrame a = RenderFrame(first, SmallCamera(), RenderOptions{}, 1.25, 7);
  const RenderedFrame b = RenderFrame(second, SmallCamera(), RenderOptions{}, 1.25, 7);
  EXPECT_EQ(a.color.data, b.color.data);
  EXPECT_EQ(a.mask.data, b.mask.data);
  EXPECT_EQ(a.depth_m, b.depth_m);
  RenderOptions other;
  other.seed = 2;
  EXPECT_NE(RenderFrame(first, SmallCamera(), other, 1.25, 7).color.data, a.color.data);
}

// A room has structure at many depths and contrast all over: without it there is nothing to track.
TEST(Renderer, RoomsHaveDepthAndTexture) {
  for (const uint64_t seed : {1, 2, 3}) {
    WorldOptions options;
    options.scene.seed = options.path.seed = seed;
    options.scene.texture_halvings = 1;
    const World world(options, SmallCamera());
    const RenderedFrame frame = RenderFrame(world, SmallCamera(), RenderOptions{}, 0, 0);
    std::vector<float> depth_m = frame.depth_m;
    std::sort(depth_m.begin(), depth_m.end());
    EXPECT_GT(depth_m.front(), 0.3f);  // Nothing is open: every pixel shows something.
    EXPECT_GT(depth_m[depth_m.size() * 9 / 10] / depth_m[depth_m.size() / 10], 1.8f);
    int cells_with_contrast = 0;
    for (int cy = 0; cy < 6; ++cy) {
      for (int cx = 0; cx < 8; ++cx) {
        int low = 255, high = 0;
        for (int i = 0; i < 1600; ++i) {
          const int value = frame.gray.at(cx * 40 + i % 40, cy * 40 + i / 40);
          low = std::min(low, value);
          high = std::max(high, value);
        }
        cells_with_contrast += high - low > 40;
      }
    }
    EXPECT_GE(cells_with_contrast, 36) << "seed " << seed;
  }
}

}  // namespace
}  // namespace dmslam
