#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <string>

#include "dmslam/map/feature_store.h"
#include "dmslam/map/replica.h"
#include "dmslam/messaging/endpoint.h"
#include "dmslam/messaging/succession.h"
#include "dmslam/wire/record_groups.h"

namespace dmslam {

/// The map that another mapper left: the newest replica of it is looked for, and fetched.
class LeftMap {
 public:
  struct Options {
    ReplicaFetch::Options fetch;
    Camera camera;
    Pyramid pyramid;
    std::shared_ptr<FeatureStore> feature_store;
  };
  enum class State : uint8_t {
    kFetching,
    kNone,          ///< nobody holds one
    kKeepsGrowing,  ///< another mapper writes it, whom the holder hears and this process does not
    kBroken,        ///< what is handed over cannot be used, however often it is asked for
    kWhole,
  };
  /// Decodes a record, and counts those that cannot be read.
  using ReadRecord = std::function<std::optional<MapDelta>(const Record&)>;
  /// Hears what is wrong with a record that can be read.
  using Complain = std::function<void(const Record&, const std::string&)>;

  LeftMap(Options options, Endpoint* endpoint, int64_t now_ns);
  ~LeftMap();
  LeftMap(const LeftMap&) = delete;
  LeftMap& operator=(const LeftMap&) = delete;

  /// Takes in what has come.
  State Advance(int64_t now_ns, const ReadRecord& read, const Complain& complain);
  /// Where it is whole.
  const Replica& replica() const { return *replica_; }
  Replica TakeReplica() { return std::move(*replica_); }
  Version version() const { return fetch_->version(); }
  std::string giver() const { return fetch_->giver(); }
  /// Who may hold one, and has not said yet whether it does; with commas.
  std::string Unanswered() const { return fetch_->Unanswered(); }

 private:
  static constexpr int kMostRefused = 5;
  static constexpr int64_t kMostRefusingNs = 10'000'000'000;  // a forger may be at work for a while
  void Begin(int64_t now_ns);
  State Refuse(int64_t now_ns);
  bool TakeIn(const Record& record, const ReadRecord& read, const Complain& complain);

  const Options options_;
  Endpoint* endpoint_;
  std::unique_ptr<ReplicaFetch> fetch_;
  std::optional<Replica> replica_;
  wire::RecordGroups<MapDelta> groups_;
  int refused_ = 0;  // fetches
  std::optional<int64_t> first_refused_ns_;
};

}  // namespace dmslam
