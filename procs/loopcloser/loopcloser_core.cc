#include "loopcloser/loopcloser_core.h"

#include <utility>

namespace dmslam {

LoopcloserCore::LoopcloserCore(const LoopcloserOptions& options, const Camera& camera, const Pyramid& pyramid,
                               uint64_t seed, std::shared_ptr<const Vocabulary> vocabulary)
    : options_(options),
      camera_(camera),
      pyramid_(pyramid),
      seed_(seed),
      vocabulary_(std::move(vocabulary)),
      map_(camera, pyramid) {}

void LoopcloserCore::ApplyMapDelta(const MapDelta& delta) { map_.Apply(delta); }

void LoopcloserCore::ForgetMap() { map_ = Map(camera_, pyramid_); }

LoopAnswer LoopcloserCore::Check(KeyframeId keyframe) {
  ++counters_.checked;
  counters_.last_keyframe = keyframe;
  LoopAnswer answer;
  answer.keyframe = keyframe;
  answer.base_version = map_.version();
  return answer;
}

}  // namespace dmslam
