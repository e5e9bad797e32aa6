#pragma once

#include <cstdint>
#include <optional>

namespace dmslam {

struct ChanceOptions {
  double max_found_share = 0.12;  ///< where less than this of what a frame should see is found...
  double max_error_ratio = 1.4;   ///< ...and fits worse by this than in usual frames, chance has found it
  double usual_share = 0.15;      ///< a frame that finds at least so much is a usual one
  double usual_s = 1.0;           ///< of these frames what is usual is the mean
};

/// Somebody who hides most of the map offers many features, and some look like landmarks behind him by
/// chance. They lie anywhere within the search windows, so they agree with whatever pose was predicted, and
/// carry it on; but they do not fit as well as landmarks that are seen. Knows how well those fit, with this
/// camera.
class ChanceMatches {
 public:
  explicit ChanceMatches(const ChanceOptions& options) : options_(options) {}

  /// Whether a frame with this share of what it should see, and this mean squared normalised error, rests on
  /// matches by chance. Nobody is suspected before usual frames were seen.
  bool Suspects(double found_share, double mean_chi2) const;
  /// Whether a frame clears what was suspected before it: it finds much, or what it finds fits as usual.
  bool Clears(double found_share, double mean_chi2) const;
  /// A frame that was tracked.
  void OnTracked(double found_share, double mean_chi2, int64_t stamp_ns);
  void Reset() { usual_.reset(); }

 private:
  struct Usual {
    double chi2 = 0;
    int64_t stamp_ns = 0;
  };
  ChanceOptions options_;
  std::optional<Usual> usual_;
};

}  // namespace dmslam
