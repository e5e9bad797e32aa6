#pragma once

#include <cstdint>
#include <string_view>

namespace dmslam {

/// Mixes 64 bits (the finaliser of SplitMix64: Steele, Lea, Flood, "Fast splittable pseudorandom number
/// generators").
constexpr uint64_t Mix64(uint64_t x) {
  x += 0x9e3779b97f4a7c15ULL;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9ULL;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebULL;
  return x ^ (x >> 31);
}

/// The seed of one randomised call, from the configured seed, the frame it works on and what it is for. Two
/// calls never share a stream, and the order of calls does not matter.
constexpr uint64_t DeriveSeed(uint64_t seed, uint64_t frame, std::string_view purpose) {
  uint64_t hash = 0xcbf29ce484222325ULL;
  for (const char c : purpose) hash = (hash ^ static_cast<uint8_t>(c)) * 0x100000001b3ULL;
  return Mix64(Mix64(Mix64(seed) ^ frame) ^ hash);
}

/// Small deterministic generator (SplitMix64): the same sequence on every platform and library, unlike the
/// distributions of <random>.
class Random {
 public:
  explicit constexpr Random(uint64_t seed) : state_(seed) {}

  constexpr uint64_t Next() {
    const uint64_t value = Mix64(state_);
    state_ += 0x9e3779b97f4a7c15ULL;
    return value;
  }
  /// Uniform in [0, bound), bound > 0.
  constexpr uint32_t Below(uint32_t bound) {
    return static_cast<uint32_t>(((Next() >> 32) * static_cast<uint64_t>(bound)) >> 32);
  }
  /// Uniform in [0, 1).
  constexpr double Uniform() { return static_cast<double>(Next() >> 11) * 0x1.0p-53; }
  constexpr double Uniform(double low, double high) { return low + (high - low) * Uniform(); }
  /// Standard normal (Box-Muller, one value per call).
  double Gaussian();

 private:
  uint64_t state_;
};

}  // namespace dmslam
