// How time grows with the map: a camera walks along an endless shelf whose things are made up, and frontend,
// mapper and loop closer work on it in lock-step until the map has so many keyframes. Prints medians at
// stations on the way, and the bytes that a feature takes on the wire. Fails where a frame or a keyframe at
// the end costs more than 1.3 times what it did at the first station, or a feature more than 45 bytes.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <vector>

#include "core_loop.h"
#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/runtime/load_vocabulary.h"
#include "dmslam/runtime/process_info.h"
#include "dmslam/runtime/process_main.h"
#include "dmslam/util/check.h"
#include "dmslam/util/random.h"
#include "dmslam/util/version.h"
#include "dmslam/wire/codec.h"

namespace dmslam::bench {
namespace {

constexpr double kNear = 2.5, kFar = 6.0,
                 kHalfHeight = 2.5;  // where things are, before and above the camera [m]
constexpr int64_t kFrameNs = 33'333'333;
constexpr double kNoisePx = 0.4;
constexpr uint32_t kFlippedBits = 12;
constexpr size_t kWindowKeyframes = 100;
constexpr double kMostOverFirst = 1.3, kMostBytesPerFeature = 45;

Camera ShelfCamera() { return TestCamera(500, 319.5, 239.5); }

/// Things along a shelf. They are made from their number alone, so that nothing need be kept.
class Shelf {
 public:
  Shelf(double things_per_m, uint64_t seed) : things_per_m_(things_per_m), seed_(seed) {}

  /// What a camera at `along` metres sees.
  FeatureSet See(const Camera& camera, const Rigid3d& T_cam_world, double along, Random* noise) const {
    FeatureSet features;
    const double reach = kFar * 0.75;
    const auto first = static_cast<int64_t>((along - reach) * things_per_m_);
    const auto last = static_cast<int64_t>((along + reach) * things_per_m_);
    for (int64_t number = std::max<int64_t>(0, first); number <= last; ++number) {
      Random thing(DeriveSeed(seed_, static_cast<uint64_t>(number), "shelf"));
      const double x = static_cast<double>(number) / things_per_m_;
      const Eigen::Vector3d p(x, thing.Uniform(-kHalfHeight, kHalfHeight), thing.Uniform(kNear, kFar));
      Add(camera, T_cam_world * p, &thing, noise, &features);
    }
    return features;
  }

 private:
  static void Add(const Camera& camera, const Eigen::Vector3d& p_cam, Random* thing, Random* noise,
                  FeatureSet* features) {
    const auto uv = camera.Project(p_cam);
    if (!uv) return;
    const double u = uv->x() + kNoisePx * noise->Gaussian(), v = uv->y() + kNoisePx * noise->Gaussian();
    if (u < 16 || v < 16 || u > camera.width_px - 17 || v > camera.height_px - 17) return;
    Descriptor descriptor{{thing->Next(), thing->Next(), thing->Next(), thing->Next()}};
    const double octave = std::log(kFar / p_cam.norm()) / std::log(1.2);
    for (uint32_t k = 0; k < kFlippedBits; ++k)
      descriptor.words[noise->Below(4)] ^= uint64_t{1} << noise->Below(64);
    features->keypoints.push_back({static_cast<uint16_t>(std::lround(u * 16)),
                                   static_cast<uint16_t>(std::lround(v * 16)),
                                   static_cast<uint8_t>(std::clamp(static_cast<int>(octave), 0, 7)), 0});
    features->descriptors.push_back(descriptor);
  }

  double things_per_m_;
  uint64_t seed_;
};

Rigid3d PoseAt(double along) {
  const Eigen::Quaterniond world_from_cam(
      Eigen::AngleAxisd(0.1 * std::sin(along * 0.35), Eigen::Vector3d::UnitY()));
  return Rigid3d(world_from_cam,
                 Eigen::Vector3d(along, 0.2 * std::sin(along * 0.8), 0.3 * std::sin(along * 0.5)))
      .Inverse();
}

double Median(std::vector<double> values) {
  if (values.empty()) return 0;
  std::nth_element(values.begin(), values.begin() + static_cast<ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// Medians over the last `kWindowKeyframes` before it, and the frames between them.
struct Station {
  size_t keyframes = 0, landmarks = 0;
  double frame_ms = 0, to_landmarks_ms = 0, mapper_ms = 0, check_ms = 0, replica_ms = 0, rss_mb = 0;

  double keyframe_ms() const { return mapper_ms + check_ms + replica_ms; }
};

class Window {
 public:
  void Add(const StepTimes& times) {
    frame_.push_back(times.frontend);
    if (!times.keyframe) return;
    to_landmarks_.push_back(times.to_landmarks);
    mapper_.push_back(times.mapper);
    check_.push_back(times.check);
    replica_.push_back(times.replica_update);
  }
  Station Take(const Map& map) {
    const Station station{map.keyframes().size(), map.num_landmarks(),    Median(frame_),
                          Median(to_landmarks_),  Median(mapper_),        Median(check_),
                          Median(replica_),       MeasureProcess().rss_mb};
    *this = Window();
    return station;
  }

 private:
  std::vector<double> frame_, to_landmarks_, mapper_, check_, replica_;
};

struct Arguments {
  size_t keyframes = 5000, first_station = 500;
  double things_per_m = 130, step_m = 0.12;
  uint64_t seed = 1;
};

/// Bytes of a keyframe's proposal per feature, when four in ten of them see landmarks.
double BytesPerFeature(FeatureSet features) {
  KeyframeProposal proposal;
  proposal.id = KeyframeId::Make(1, 1);
  proposal.map_id = 1;
  proposal.stamp_ns = 1;
  proposal.features = std::move(features);
  const double count = static_cast<double>(proposal.features.size());
  for (uint16_t i = 0; i < 0.4 * count; ++i) proposal.matches.push_back({i, LandmarkId::Make(1, i + 1U)});
  return static_cast<double>(wire::Encode(proposal).size()) / count;
}

void Print(const Station& s) {
  std::printf("%9zu %9zu %9.2f %13.1f %9.1f %9.2f %9.2f %9.0f\n", s.keyframes, s.landmarks, s.frame_ms,
              s.to_landmarks_ms, s.mapper_ms, s.check_ms, s.replica_ms, s.rss_mb);
  std::fflush(stdout);
}

int Judge(const std::vector<Station>& stations, double bytes) {
  const double frame = stations.back().frame_ms / stations.front().frame_ms;
  const double keyframe = stations.back().keyframe_ms() / stations.front().keyframe_ms();
  std::printf(
      "end / first station: frame %.2f, keyframe %.2f (at most %.1f); %.1f bytes per feature (at most "
      "%.0f)\n",
      frame, keyframe, kMostOverFirst, bytes, kMostBytesPerFeature);
  return frame <= kMostOverFirst && keyframe <= kMostOverFirst && bytes <= kMostBytesPerFeature ? 0 : 1;
}

int Run(const Arguments& a) {
  const Camera camera = ShelfCamera();
  const Shelf shelf(a.things_per_m, a.seed);
  CoreLoop loop(Settings(), camera, LoadVocabulary(""));
  Random noise(DeriveSeed(a.seed, 0, "shelf noise"));
  std::vector<Station> stations;
  Window window;
  double bytes = 0;
  std::printf("keyframes landmarks  frame_ms  landmarks_ms mapper_ms  check_ms replica_ms   rss_mb\n");
  size_t next = a.first_station;
  bool near_station = false;
  for (uint32_t i = 0; loop.map().keyframes().size() < a.keyframes; ++i) {
    const double along = 20 + a.step_m * i;
    FeatureSet features = shelf.See(camera, PoseAt(along), along, &noise);
    if (i == 0) bytes = BytesPerFeature(features);
    const StepTimes times = loop.StepFeatures(i, static_cast<int64_t>(i) * kFrameNs + 1, std::move(features));
    if (loop.frontend().state() != TrackingState::kTracking) {
      if (i > 2000 && loop.map().keyframes().size() < 2)
        throw InputError("no first map was found on the shelf");
      continue;
    }
    const size_t keyframes = loop.map().keyframes().size();
    near_station = near_station || keyframes + kWindowKeyframes >= next;
    if (near_station) window.Add(times);
    if (keyframes < next) continue;
    near_station = false;
    stations.push_back(window.Take(loop.map()));
    Print(stations.back());
    next += a.first_station;
  }
  if (stations.size() < 2) throw InputError("--keyframes must be at least twice --station");
  const FrontendCounters& counters = loop.frontend().counters();
  std::printf("%llu frames, %llu tracked, %llu resets\n", static_cast<unsigned long long>(counters.frames),
              static_cast<unsigned long long>(counters.tracked),
              static_cast<unsigned long long>(counters.resets));
  const EndTimes end = loop.End();
  std::printf("end of the run: %.1f s, %.1f of them the adjustment of the map\n", end.all, end.adjustment);
  return Judge(stations, bytes);
}

int Main(int argc, char** argv) {
  CLI::App app{"Time per frame and per keyframe while a synthetic map grows"};
  app.set_version_flag("--version", kVersion);
  Arguments a;
  app.add_option("--keyframes", a.keyframes, "the map's size at the end")->capture_default_str();
  app.add_option("--station", a.first_station, "keyframes between stations")->capture_default_str();
  app.add_option("--density", a.things_per_m, "things on a metre of the shelf")->capture_default_str();
  app.add_option("--step", a.step_m, "between frames [m]")->capture_default_str();
  app.add_option("--seed", a.seed)->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return Run(a);
}

}  // namespace
}  // namespace dmslam::bench

int main(int argc, char** argv) {
  try {
    return dmslam::bench::Main(argc, argv);
  } catch (const dmslam::InputError& error) {
    std::fprintf(stderr, "tour_bench: %s\n", error.what());
    return 1;
  }
}
