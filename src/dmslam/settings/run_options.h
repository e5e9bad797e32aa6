#pragma once

#include <cstdint>

namespace dmslam {

/// What concerns every process of a run.
struct RunOptions {
  uint64_t seed = 1;
  bool saved_map = false;  ///< the mapper has loaded one: the frontend waits for it and finds itself in it
  bool localize_only = false;  ///< ... and nothing changes it

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Number("seed", seed, 0, 18446744073709551615.0, "", "seed of everything random");
    v.Switch("map.saved", saved_map, "the run begins in the map that the mapper loads (--map)");
    v.Switch("map.localize_only", localize_only, "nothing changes that map");
  }
};

/// What the collector keeps on disk while a run goes on.
struct CheckpointOptions {
  double every_s = 10.0;

  template <typename Visitor>
  void Describe(Visitor& v) {
    v.Number("collector.checkpoint_s", every_s, 0, 3600, "s",
             "age at which a change of the map must be in OUT/checkpoint.lcmlog, from which a run whose "
             "processes all died goes on; 0: no checkpoints");
    v.ChangesNoResult();
  }
};

}  // namespace dmslam
