// How soon a process that joins a running system has the map: a reader of the map stream in the viewer's
// place. Prints when the local map (the newest keyframe and those around it) and when all of it was there;
// ends with 1 where that took more than 1 s and 30 s. Start dmslam-map-tour, or a system without a viewer,
// before it. Times count from its start; until the camera is heard, which is repeated every second, it cannot
// ask for anything.
#include <cstdio>
#include <memory>

#include "dmslam/map/replica.h"
#include "dmslam/runtime/process_main.h"
#include "dmslam/runtime/stream_node.h"

namespace dmslam::bench {
namespace {

constexpr size_t kLocalKeyframes = 21;
constexpr double kLocal_s = 1.0, kAll_s = 30.0;

class LateComer : public StreamNode {
 public:
  LateComer(NodeContext context, NodeOptions options)
      : StreamNode(std::move(context), std::move(options), "viewer"), begun_ns_(context_.now_ns()) {}

 protected:
  void Begin(const CameraInfo& info) override {
    camera_s_ = Elapsed();
    map_ = std::make_unique<Replica>(info.camera, Pyramid());
    reader_ = MakeReader(StreamId::kMap);
  }

  bool WorkOnce() override {
    const std::optional<Record> record = reader_->Take();
    if (!record) return false;
    if (record->begins_anew()) map_ = std::make_unique<Replica>(map_->camera(), map_->pyramid());
    bytes_ += record->bytes->size();
    if (const auto delta = Read<MapDelta>(*record->bytes)) map_->Apply(*delta);
    reader_->AcceptTaken();
    if (local_s_ < 0 && map_->keyframes().size() >= kLocalKeyframes) local_s_ = Elapsed();
    if (record->ends_snapshot()) Tell();
    return true;
  }

  void PublishStatus() override {}

 private:
  double Elapsed() const { return static_cast<double>(context_.now_ns() - begun_ns_) * 1e-9; }

  void Tell() {
    const double all_s = Elapsed();
    std::printf(
        "%zu keyframes, %zu landmarks, %.1f MB: camera heard after %.2f s, local map %.2f s later (at most "
        "%.0f), all "
        "after %.2f s (at most %.0f)\n",
        map_->keyframes().size(), map_->num_landmarks(), static_cast<double>(bytes_) * 1e-6, camera_s_,
        local_s_ - camera_s_, kLocal_s, all_s, kAll_s);
    Exit(local_s_ - camera_s_ <= kLocal_s && all_s <= kAll_s ? 0 : 1);
  }

  int64_t begun_ns_;
  std::unique_ptr<Replica> map_;
  std::unique_ptr<StreamReader> reader_;
  size_t bytes_ = 0;
  double camera_s_ = 0, local_s_ = -1;
};

}  // namespace
}  // namespace dmslam::bench

int main(int argc, char** argv) {
  dmslam::ProcessMain process("late-comer", "Joins a running system and tells when it has the map.");
  return process.Run(argc, argv, [](dmslam::NodeContext context, dmslam::NodeOptions options) {
    return std::make_unique<dmslam::bench::LateComer>(std::move(context), std::move(options));
  });
}
