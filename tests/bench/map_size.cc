// What a large map takes: a made-up one (tools/map_tour) is built record by record beside a replica,
// corrected by a loop and adjusted as a whole, saved, loaded, and handed to a late comer, all through encoded
// records. Prints records, bytes, times and memory of each step. Fails where a record is larger than the
// bound, or where replica, loaded map or late comer differ from the writer's map in one bit.
#include <sys/resource.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <ctime>
#include <filesystem>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/map/feature_store.h"
#include "dmslam/map/replica.h"
#include "dmslam/map/snapshot.h"
#include "dmslam/mapping/correction.h"
#include "dmslam/recording/map_file.h"
#include "dmslam/runtime/map_snapshots.h"
#include "dmslam/runtime/process_info.h"
#include "dmslam/util/check.h"
#include "dmslam/wire/codec.h"
#include "dmslam/wire/record_groups.h"
#include "tour_map.h"

namespace dmslam::bench {
namespace {

constexpr double kMegabyte = 1e6;

/// Of the processor: the machine may have other work.
double Seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double ResidentMegabytes() {
  ReturnFreeMemory();
  return MeasureProcess().rss_mb;
}

double MostResidentMegabytes() {
  rusage usage{};
  getrusage(RUSAGE_SELF, &usage);
  return static_cast<double>(usage.ru_maxrss) / 1024.0;
}

/// What went over the wire in one step.
struct Traffic {
  size_t records = 0, bytes = 0, largest = 0;
  double write_s = 0;  ///< cutting and encoding
  double read_s = 0;   ///< decoding and applying

  void Add(const Bytes& record) {
    ++records;
    bytes += record.size();
    largest = std::max(largest, record.size());
  }
};

/// A replica on the other side of the wire.
class Reader {
 public:
  explicit Reader(std::shared_ptr<FeatureStore> features) : map_(TourMap::TourCamera(), Pyramid()) {
    map_.KeepFeaturesIn(std::move(features));
  }

  /// Writes and reads a change record by record.
  void Take(MapDelta change, Traffic* traffic) {
    double begin = Seconds();
    std::vector<MapDelta> records = wire::Split(std::move(change));
    traffic->write_s += Seconds() - begin;
    for (MapDelta& record : records) {
      begin = Seconds();
      const Bytes bytes = wire::Encode(record);
      record = {};
      traffic->write_s += Seconds() - begin;
      Take(bytes, traffic);
    }
  }
  void Take(const Bytes& bytes, Traffic* traffic) {
    traffic->Add(bytes);
    const double begin = Seconds();
    std::optional<MapDelta> change = groups_.Add(*wire::Decode<MapDelta>(bytes));
    DMSLAM_CHECK(groups_.fault().empty(), "a group that is broken");
    if (change) map_.Apply(*change);
    traffic->read_s += Seconds() - begin;
  }
  const Map& map() const { return map_; }

 private:
  Replica map_;
  wire::RecordGroups<MapDelta> groups_;
};

bool SamePose(const Keyframe& a, const Keyframe& b) {
  return a.T_cam_world.rotation.coeffs() == b.T_cam_world.rotation.coeffs() &&
         a.T_cam_world.translation == b.T_cam_world.translation && a.scale == b.scale;
}

bool Same(const Map& a, const Map& b) {
  if (a.keyframes().size() != b.keyframes().size() || a.num_landmarks() != b.num_landmarks()) return false;
  for (const auto& [id, keyframe] : a.keyframes()) {
    const Keyframe* other = b.FindKeyframe(id);
    if (other == nullptr || !SamePose(keyframe, *other) || keyframe.landmarks != other->landmarks)
      return false;
    const FeatureSet &features = keyframe.features->set, &others = other->features->set;
    if (features.keypoints != others.keypoints || features.descriptors != others.descriptors) return false;
  }
  return std::ranges::all_of(a.LandmarkIdsSorted(), [&](LandmarkId id) {
    const Landmark* other = b.FindLandmark(id);
    return other != nullptr && a.At(id).p_world == other->p_world && a.At(id).evidence == other->evidence;
  });
}

/// The way drifts more and more up to its end, by `yaw_rad` and a scale of `scale`.
LoopAnswer MakeLoop(const Map& map, double yaw_rad, double scale) {
  LoopAnswer answer;
  answer.kind = LoopAnswer::Kind::kLoop;
  answer.keyframe = map.keyframes().rbegin()->first;
  answer.seen_from = answer.keyframe;
  answer.matched = map.keyframes().begin()->first;
  answer.correction_id = answer.keyframe.value;
  answer.base_version = map.version();
  size_t i = 0;
  for (const auto& [id, keyframe] : map.keyframes()) {
    const double share = static_cast<double>(i++) / static_cast<double>(map.keyframes().size());
    Sim3d correction;
    correction.rotation = Eigen::Quaterniond(Eigen::AngleAxisd(yaw_rad * share, Eigen::Vector3d::UnitY()));
    correction.scale = 1 + (scale - 1) * share;
    answer.corrections.push_back({id, correction});
  }
  return answer;
}

/// Keyframes hardly move, and every landmark by itself.
LoopAnswer MakeAdjustment(const Map& map) {
  LoopAnswer answer = MakeLoop(map, 1e-4, 1.0001);
  answer.kind = LoopAnswer::Kind::kGlobalAdjustment;
  answer.seen_from.reset();
  answer.matched.reset();
  for (const LandmarkId id : map.LandmarkIdsSorted())
    answer.landmark_offsets.push_back({id, {1e-4, -2e-4, 3e-4}});
  return answer;
}

class Table {
 public:
  Table() {
    std::printf("| step | records | together [MB] | largest [kB] | writer, CPU [s] | reader, CPU [s] |\n");
    std::printf("|---|---|---|---|---|---|\n");
  }
  void Add(const char* step, const Traffic& traffic) {
    largest_ = std::max(largest_, traffic.largest);
    std::printf("| %s | %zu | %.1f | %.1f | %.2f | %.2f |\n", step, traffic.records,
                static_cast<double>(traffic.bytes) / kMegabyte, static_cast<double>(traffic.largest) / 1e3,
                traffic.write_s, traffic.read_s);
    std::fflush(stdout);
  }
  size_t largest() const { return largest_; }

 private:
  size_t largest_ = 0;
};

/// The answer as the mapper gets it.
LoopAnswer ThroughRecords(LoopAnswer answer, Traffic* traffic) {
  wire::RecordGroups<LoopAnswer> groups;
  std::optional<LoopAnswer> whole;
  double begin = Seconds();
  const std::vector<LoopAnswer> records = wire::Split(std::move(answer));
  traffic->write_s += Seconds() - begin;
  for (const LoopAnswer& record : records) {
    begin = Seconds();
    const Bytes bytes = wire::Encode(record);
    traffic->write_s += Seconds() - begin;
    traffic->Add(bytes);
    begin = Seconds();
    whole = groups.Add(*wire::Decode<LoopAnswer>(bytes));
    traffic->read_s += Seconds() - begin;
  }
  return std::move(*whole);
}

int Run(const TourOptions& options, const FeatureStoreOptions& memory, const std::string& path) {
  const double empty_mb = ResidentMegabytes();
  const auto writers_features = std::make_shared<FeatureStore>(memory);
  const auto readers_features = std::make_shared<FeatureStore>(memory);
  TourMap tour(options, 1);
  tour.KeepFeaturesIn(writers_features);
  Table table;
  Traffic building;
  double replica_mb = 0, writer_mb = 0;
  {
    // First the writer alone, then a replica of what it has: so that each one's memory is known.
    while (!tour.done()) {
      const double begin = Seconds();
      const Bytes bytes = wire::Encode(tour.Step());
      building.write_s += Seconds() - begin;
      building.Add(bytes);
    }
    writers_features->LetGo();
    writer_mb = ResidentMegabytes() - empty_mb;
  }
  table.Add("built, a record per keyframe", building);

  Reader replica(readers_features);
  const auto hand_over = [&](Reader* reader, Traffic* traffic) {
    MapSnapshots snapshots(&tour.map());
    const double begin = Seconds();
    snapshots.BeginSnapshot(0);
    traffic->write_s += Seconds() - begin;
    for (bool last = false; !last;) {
      const double piece_begin = Seconds();
      const SnapshotSource::Piece piece = snapshots.NextPiece();
      traffic->write_s += Seconds() - piece_begin;
      reader->Take(piece.message, traffic);
      last = piece.last;
    }
  };
  Traffic first_snapshot;
  hand_over(&replica, &first_snapshot);
  writers_features->LetGo();
  readers_features->LetGo();
  replica_mb = ResidentMegabytes() - empty_mb - writer_mb;
  table.Add("snapshot for a replica", first_snapshot);
  bool same = Same(tour.map(), replica.map());

  for (const bool loop : {true, false}) {
    Traffic asked, told;
    const LoopAnswer answer =
        ThroughRecords(loop ? MakeLoop(tour.map(), 0.02, 1.05) : MakeAdjustment(tour.map()), &asked);
    table.Add(loop ? "loop, as it is proposed" : "global adjustment, as it is proposed", asked);
    const double begin = Seconds();
    MapDelta change = tour.Correct(answer);
    told.write_s = Seconds() - begin;
    replica.Take(std::move(change), &told);
    table.Add(loop ? "loop, applied" : "global adjustment, applied", told);
    same = same && Same(tour.map(), replica.map());
  }

  SessionStart session;
  session.session = 1;
  session.camera = TourMap::TourCamera();
  double begin = Seconds();
  SaveMap(path, tour.map(), session);
  const double save_s = Seconds() - begin;
  {
    begin = Seconds();
    const RebuiltMap loaded = LoadMap(path, std::nullopt, std::make_shared<FeatureStore>(memory));
    const double load_s = Seconds() - begin;
    same = same && loaded.missing == 0 && Same(tour.map(), loaded.map);
    std::printf("\nsaved in %.1f s of CPU (%.1f MB), loaded in %.1f s\n", save_s,
                static_cast<double>(std::filesystem::file_size(path)) / kMegabyte, load_s);
  }
  std::filesystem::remove(path);
  std::printf(
      "%zu keyframes, %zu landmarks, %zu features a keyframe: %.0f MB for the writer's map, %.0f MB for a "
      "replica, %.0f MB most of all in this process\n",
      tour.map().keyframes().size(), tour.map().num_landmarks(),
      tour.map().keyframes().rbegin()->second.features->size(), writer_mb, replica_mb,
      MostResidentMegabytes());
  std::printf(
      "features of the writer's map: %.0f MB in memory, %.0f MB in the file; of the replica's %.0f, %.0f\n",
      static_cast<double>(writers_features->bytes_in_memory()) / kMegabyte,
      static_cast<double>(writers_features->bytes_in_file()) / kMegabyte,
      static_cast<double>(readers_features->bytes_in_memory()) / kMegabyte,
      static_cast<double>(readers_features->bytes_in_file()) / kMegabyte);
  std::printf("largest record %zu bytes, bound %zu; replica and loaded map %s\n", table.largest(),
              wire::kMaxRecordBytes, same ? "are the writer's, bit for bit" : "DIFFER from the writer's");
  return same && table.largest() <= wire::kMaxRecordBytes ? 0 : 1;
}

}  // namespace
}  // namespace dmslam::bench

int main(int argc, char** argv) {
  CLI::App app("Records, times and memory of a large made-up map");
  dmslam::TourOptions options;
  dmslam::FeatureStoreOptions memory;
  std::string path = "map_size.log";
  app.add_option("--keyframes", options.keyframes)->capture_default_str();
  app.add_option("--landmarks", options.landmarks)->capture_default_str();
  app.add_option("--features", options.features, "of a keyframe, at least")->capture_default_str();
  app.add_option("--features-mb", memory.memory_mb, "of features in the memory of each map (map.features_mb)")
      ->capture_default_str();
  app.add_option("--file", path, "where the map is saved, and removed again")->capture_default_str();
  CLI11_PARSE(app, argc, argv);
  return dmslam::bench::Run(options, memory, path);
}
