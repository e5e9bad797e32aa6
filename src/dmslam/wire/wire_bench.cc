#include <benchmark/benchmark.h>

#include "dmslam/wire/testing/random_message.h"

// Encoding and decoding of each message at the size it has in a run: 1000 features per frame, 60 kB per
// image.
namespace dmslam::wire {
namespace {

template <typename Message>
Message Typical() {
  return testing::RandomMessage<Message>(1, 0);
}

FeatureSet ThousandFeatures() {
  FeatureSet features;
  features.keypoints.resize(1000);
  features.descriptors.resize(1000);
  return features;
}

template <>
Frame Typical<Frame>() {
  Frame frame = testing::RandomMessage<Frame>(1, 0);
  frame.encoding = FrameEncoding::kJpeg;
  frame.data.resize(60000);
  return frame;
}

template <>
KeyframeProposal Typical<KeyframeProposal>() {
  KeyframeProposal keyframe = testing::RandomMessage<KeyframeProposal>(1, 0);
  keyframe.features = ThousandFeatures();
  for (uint16_t i = 0; i < 400; ++i) keyframe.matches.push_back({i, LandmarkId::Make(1, i)});
  return keyframe;
}

template <>
InitialMap Typical<InitialMap>() {
  InitialMap map = testing::RandomMessage<InitialMap>(1, 0);
  map.first.features = map.second.features = ThousandFeatures();
  map.points.resize(300);
  return map;
}

template <>
FrameEvidence Typical<FrameEvidence>() {
  FrameEvidence evidence = testing::RandomMessage<FrameEvidence>(1, 0);
  for (uint64_t i = 0; i < 500; ++i) evidence.items.push_back({LandmarkId::Make(1, i), 3, 2, 1});
  return evidence;
}

template <>
FeatureView Typical<FeatureView>() {
  FeatureView view = testing::RandomMessage<FeatureView>(1, 0);
  view.items.resize(1000);
  return view;
}

/// A keyframe with its features and observations, a hundred new landmarks, and what a local bundle adjustment
/// moves.
template <>
MapDelta Typical<MapDelta>() {
  MapDelta delta;
  const KeyframeId id = KeyframeId::Make(1, 100);
  KeyframeState& keyframe = delta.keyframes.emplace_back();
  keyframe.id = id;
  keyframe.map_id = 1;
  keyframe.features = std::make_shared<const FeatureSet>(ThousandFeatures());
  for (uint16_t i = 0; i < 400; ++i) delta.observations.push_back({id, i, LandmarkId::Make(1, i)});
  for (uint64_t i = 0; i < 100; ++i) {
    LandmarkState& landmark = delta.landmarks.emplace_back();
    landmark.id = LandmarkId::Make(1, i);
    landmark.map_id = 1;
    landmark.reference = landmark.first_keyframe = id;
  }
  for (uint32_t i = 0; i < 20; ++i) delta.keyframe_poses.push_back({KeyframeId::Make(1, i), {}, 1.0});
  for (uint64_t i = 0; i < 2000; ++i) delta.landmark_positions.push_back({LandmarkId::Make(1, i), {0, 0, 1}});
  return delta;
}

template <typename Message>
void BM_Encode(benchmark::State& state) {
  const auto message = Typical<Message>();
  size_t bytes = 0;
  for (auto _ : state) {
    const std::vector<uint8_t> encoded = Encode(message);
    bytes = encoded.size();
    benchmark::DoNotOptimize(encoded.data());
  }
  state.counters["bytes"] = static_cast<double>(bytes);
}

template <typename Message>
void BM_Decode(benchmark::State& state) {
  const std::vector<uint8_t> bytes = Encode(Typical<Message>());
  for (auto _ : state) {
    const std::optional<Message> message = Decode<Message>(bytes);
    benchmark::DoNotOptimize(message.has_value());
  }
  state.counters["bytes"] = static_cast<double>(bytes.size());
}

template <typename Message>
void RegisterOne() {
  const std::string name = Info<Message>().type;
  benchmark::RegisterBenchmark(("encode/" + name).c_str(), BM_Encode<Message>)->Unit(benchmark::kMicrosecond);
  benchmark::RegisterBenchmark(("decode/" + name).c_str(), BM_Decode<Message>)->Unit(benchmark::kMicrosecond);
}

}  // namespace
}  // namespace dmslam::wire

int main(int argc, char** argv) {
  benchmark::Initialize(&argc, argv);
  dmslam::wire::testing::ForEachMessage([]<typename Message>() { dmslam::wire::RegisterOne<Message>(); });
  benchmark::RunSpecifiedBenchmarks();
  return 0;
}
