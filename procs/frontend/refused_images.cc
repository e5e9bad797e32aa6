#include "frontend/refused_images.h"

namespace dmslam {
namespace {

constexpr int64_t kMostOfOtherSize = 3;  // frames, before the first one that fits

}  // namespace

RefusedImages::Consequence RefusedImages::Count(const ImageProblem& problem, bool any_fitted) {
  if (problem.kind == ImageProblem::Kind::kOtherSize) ++of_other_size_;
  const bool of_other_camera =
      problem.kind == ImageProblem::Kind::kOtherSize && !any_fitted && of_other_size_ >= kMostOfOtherSize;
  if (of_other_camera) return Consequence::kOtherCamera;
  return bad_++ == 0 ? Consequence::kWarn : Consequence::kNone;
}

}  // namespace dmslam
