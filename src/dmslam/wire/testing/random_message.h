#pragma once

#include <algorithm>
#include <array>
#include <bit>
#include <concepts>
#include <cstring>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <vector>

#include "dmslam/util/random.h"
#include "dmslam/wire/codec.h"
#include "dmslam/wire/testing/aggregate.h"

// Random messages that Decode accepts, and their comparison, member by member. For tests, fuzzing and
// benchmarks.
namespace dmslam::wire::testing {

using internal::kIsOptional;
template <typename T>
inline constexpr bool kIsVector = false;
template <typename Item, typename Memory>
inline constexpr bool kIsVector<std::vector<Item, Memory>> = true;
template <typename T>
inline constexpr bool kIsShared = false;
template <typename Item>
inline constexpr bool kIsShared<std::shared_ptr<Item>> = true;
template <typename T>
inline constexpr bool kIsArray = false;
template <typename Item, size_t kSize>
inline constexpr bool kIsArray<std::array<Item, kSize>> = true;

/// Structs all of whose members are drawn, as optional indices and real numbers always are. Which of them are
/// not there is for MakeSound to say.
template <typename T>
inline constexpr bool kDrawnInFull = false;
template <>
inline constexpr bool kDrawnInFull<CameraInfo> = true;
template <>
inline constexpr bool kDrawnInFull<PlayerStatus> = true;
template <>
inline constexpr bool kDrawnInFull<KeyframeState> = true;
template <>
inline constexpr bool kDrawnInFull<LandmarkEvidence> = true;
template <>
inline constexpr bool kDrawnInFull<ObservationState> = true;
template <>
inline constexpr bool kDrawnInFull<LandmarkTombstone> = true;

/// Fills everything with random values of all sizes; ids, poses and real numbers are such as may travel.
class Filler {
 public:
  Filler(uint64_t seed, uint32_t max_items) : random_(seed), max_items_(max_items) {}
  Random& random() { return random_; }

  void operator()(bool& value) { value = random_.Below(2) == 1; }
  template <std::unsigned_integral T>
  void operator()(T& value) {
    value = static_cast<T>(random_.Next() >> random_.Below(64));
  }
  /// Signed numbers count, or are stamps: never below zero.
  template <std::signed_integral T>
  void operator()(T& value) {
    value = static_cast<T>((random_.Next() >> random_.Below(64)) &
                           static_cast<uint64_t>(std::numeric_limits<T>::max()));
  }
  template <std::floating_point T>
  void operator()(T& value) {
    const double tiny = std::numeric_limits<T>::denorm_min();
    const std::array<double, 4> special = {0.0, -0.0, 1.0, tiny};
    value = static_cast<T>(random_.Below(8) == 0 ? special[random_.Below(4)] : random_.Uniform(-1e6, 1e6));
  }
  void operator()(std::string& text) {
    static constexpr std::array<const char*, 6> kPieces = {"lost",         " ", "42 of 64", "\xc3\xa4",
                                                           "\xe2\x82\xac", "\n"};
    text.clear();
    for (uint32_t i = random_.Below(8); i > 0; --i) text += kPieces[random_.Below(6)];
  }
  // One draw a statement: in which order arguments are evaluated is the compiler's affair.
  void operator()(KeyframeId& id) {
    const uint32_t frame = random_.Below(100000);
    id = KeyframeId::Make(1 + random_.Below(3), frame);
  }
  void operator()(LandmarkId& id) {
    const uint64_t number = random_.Next() & 0xffffffffffffULL;
    id = LandmarkId::Make(static_cast<uint16_t>(1 + random_.Below(3)), number);
  }
  void operator()(Eigen::Vector3d& p) { p = {Real(), Real(), Real()}; }
  void operator()(Eigen::Quaterniond& q) {
    do {
      for (int i = 3; i >= 0; --i) q.coeffs()[i] = random_.Uniform(-1, 1);
    } while (q.coeffs().squaredNorm() < 0.01);
    q.normalize();
  }
  void operator()(Rigid3d& T) { (*this)(T.rotation), (*this)(T.translation); }
  void operator()(Sim3d& S) {
    (*this)(S.rotation), (*this)(S.translation), S.scale = random_.Uniform(0.1, 10);
  }
  /// The size of its finest pixels does not travel: the images' size says it.
  void operator()(Pyramid& pyramid) { (*this)(pyramid.levels), (*this)(pyramid.scale_factor); }
  template <typename T>
  void operator()(T& value) {
    if constexpr (std::is_enum_v<T>) {
      value = static_cast<T>(
          1);  // known to all enumerations that travel; the messages' own are drawn in MakeSound
    } else if constexpr (kIsOptional<T>) {
      value.reset();
      using Value = typename T::value_type;
      const bool in_full = in_full_ || std::is_same_v<Value, int32_t> || std::is_floating_point_v<Value>;
      if (!in_full && random_.Below(3) == 0) return;
      (*this)(value.emplace());
      if constexpr (std::is_unsigned_v<Value>) value = std::max<Value>(*value, 1);
    } else if constexpr (kIsShared<T>) {
      bool there = false;
      (*this)(there);
      std::remove_const_t<typename T::element_type> content;
      (*this)(content);
      value = there ? std::make_shared<typename T::element_type>(std::move(content)) : nullptr;
    } else if constexpr (kIsVector<T>) {
      value.resize(random_.Below(max_items_ + 1));
      for (auto& item : value) (*this)(item);
    } else if constexpr (kIsArray<T>) {
      for (auto& item : value) (*this)(item);
    } else {
      const bool before = std::exchange(in_full_, kDrawnInFull<T>);
      std::apply([&](auto&... members) { ((*this)(members), ...); }, TieMembers(value));
      in_full_ = before;
    }
  }

 private:
  double Real() {
    double value = 0;
    (*this)(value);
    return value;
  }

  Random random_;
  uint32_t max_items_;
  bool in_full_ = false;
};

/// Makes a random message keep the promises that Decode checks.
void MakeSound(CameraInfo& m, Random& random);
void MakeSound(Frame& m, Random& random);
void MakeSound(EndOfSequence& m, Random& random);
void MakeSound(GroundTruthPose& m, Random& random);
void MakeSound(PlayerStatus& m, Random& random);
void MakeSound(SessionStart& m, Random& random);
void MakeSound(InitialMap& m, Random& random);
void MakeSound(KeyframeProposal& m, Random& random);
void MakeSound(FramePose& m, Random& random);
void MakeSound(FrameEvidence& m, Random& random);
void MakeSound(MapReset& m, Random& random);
void MakeSound(AdjustRequest& m, Random& random);
void MakeSound(TurnRequest& m, Random& random);
void MakeSound(FrameDone& m, Random& random);
void MakeSound(SequenceDone& m, Random& random);
void MakeSound(Odometry& m, Random& random);
void MakeSound(PoseView& m, Random& random);
void MakeSound(FeatureView& m, Random& random);
void MakeSound(FrameTrace& m, Random& random);
void MakeSound(FrontendStatus& m, Random& random);
void MakeSound(MapDelta& m, Random& random);
void MakeSound(MapperStatus& m, Random& random);
void MakeSound(LoopAnswer& m, Random& random);
void MakeSound(LoopcloserStatus& m, Random& random);

/// A message full of random values; lists have at most `max_items` items.
template <typename Message>
Message RandomMessage(uint64_t seed, uint32_t max_items = 5) {
  Filler fill(seed, max_items);
  Message message;
  fill(message);
  MakeSound(message, fill.random());
  return message;
}

/// Whether two values are the same bit for bit.
template <typename T>
bool Identical(const T& a, const T& b) {
  if constexpr (std::is_arithmetic_v<T> || std::is_enum_v<T>) {
    return std::memcmp(&a, &b, sizeof(T)) == 0;
  } else if constexpr (std::is_same_v<T, std::string>) {
    return a == b;
  } else if constexpr (std::is_same_v<T, KeyframeId> || std::is_same_v<T, LandmarkId>) {
    return a.value == b.value;
  } else if constexpr (std::is_same_v<T, Eigen::Vector3d>) {
    return std::memcmp(a.data(), b.data(), sizeof(double) * 3) == 0;
  } else if constexpr (std::is_same_v<T, Eigen::Quaterniond>) {
    return std::memcmp(a.coeffs().data(), b.coeffs().data(), sizeof(double) * 4) == 0;
  } else if constexpr (std::is_same_v<T, Rigid3d>) {
    return Identical(a.rotation, b.rotation) && Identical(a.translation, b.translation);
  } else if constexpr (std::is_same_v<T, Sim3d>) {
    return Identical(a.rotation, b.rotation) && Identical(a.translation, b.translation) &&
           Identical(a.scale, b.scale);
  } else if constexpr (kIsOptional<T>) {
    return a.has_value() == b.has_value() && (!a.has_value() || Identical(*a, *b));
  } else if constexpr (kIsShared<T>) {
    return (a == nullptr) == (b == nullptr) && (a == nullptr || Identical(*a, *b));
  } else if constexpr (kIsVector<T> || kIsArray<T>) {
    bool same = a.size() == b.size();
    for (size_t i = 0; same && i < a.size(); ++i) same = Identical(a[i], b[i]);
    return same;
  } else {
    const auto members_a = TieMembers(a);
    const auto members_b = TieMembers(b);
    return [&]<size_t... kI>(std::index_sequence<kI...>) {
      return (Identical(std::get<kI>(members_a), std::get<kI>(members_b)) && ...);
    }
    (std::make_index_sequence<kNumMembers<T>>());
  }
}

/// Calls `visit.operator()<Message>()` for each of `Messages`.
template <typename Visit>
void ForEachMessage(Visit visit) {
  [&]<typename... Message>(std::type_identity<std::tuple<Message...>>) {
    (visit.template operator()<Message>(), ...);
  }(std::type_identity<Messages>());
}

}  // namespace dmslam::wire::testing
