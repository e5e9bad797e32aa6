#include "dmslam/motion_segmentation/two_view_model.h"

#include <Eigen/LU>
#include <algorithm>
#include <array>
#include <cmath>

#include "dmslam/geometry/rigid3.h"
#include "dmslam/geometry/solve_symmetric.h"
#include "dmslam/geometry/symmetric_eigen.h"
#include "dmslam/geometry/two_view.h"
#include "dmslam/motion_segmentation/epipolar_sums.h"
#include "dmslam/robust/ransac.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {
namespace {

using Matrix5d = Eigen::Matrix<double, 5, 5>;
using Vector5d = Eigen::Matrix<double, 5, 1>;

/// Two directions that span the plane across `t`.
Eigen::Matrix<double, 3, 2> Tangent(const Eigen::Vector3d& t) {
  const Eigen::Vector3d helper = std::abs(t.x()) < 0.6 ? Eigen::Vector3d::UnitX() : Eigen::Vector3d::UnitY();
  Eigen::Matrix<double, 3, 2> B;
  B.col(0) = t.cross(helper).normalized();
  B.col(1) = t.cross(B.col(0));
  return B;
}

/// Algebraic epipolar residual t . (R ray0 x ray1) and its derivative with respect to a left rotation and to
/// t in its tangent plane.
struct EssentialRow {
  double residual = 0;
  Vector5d jacobian;
};

[[gnu::always_inline]] inline EssentialRow MakeEssentialRow(const Eigen::Vector3d& y,
                                                            const Eigen::Vector3d& ray1,
                                                            const Eigen::Vector3d& t,
                                                            const Eigen::Matrix<double, 3, 2>& B) {
  EssentialRow row;
  const Eigen::Vector3d normal = y.cross(ray1);
  row.residual = t.dot(normal);
  row.jacobian.head<3>() = y.cross(ray1.cross(t));
  row.jacobian.tail<2>() = B.transpose() * normal;
  return row;
}

Eigen::Matrix3d SmallRotation(const Eigen::Vector3d& w) { return ExpSo3(w).toRotationMatrix(); }

void UpdateEssential(const Vector5d& step, const Eigen::Matrix<double, 3, 2>& B, TwoViewModel* model) {
  model->R = SmallRotation(step.head<3>()) * model->R;
  model->t = (model->t + B * step.tail<2>()).normalized();
}

/// Sampson's denominator with both points' bounds, for row vectors of M.
[[gnu::always_inline]] inline double SampsonBound(const Eigen::Matrix3d& M, const MatchArrays& a, size_t i) {
  const Eigen::Vector3d l1 = M * a.ray0[i];
  const Eigen::Vector3d l0 = M.transpose() * a.ray1[i];
  return a.bound1[i] * l1.head<2>().squaredNorm() + a.bound0[i] * l0.head<2>().squaredNorm();
}

}  // namespace

MatchArrays MakeArrays(std::span<const Match> matches, std::span<const uint32_t> order, const Camera& camera,
                       const InlierOptions& options) {
  MatchArrays arrays;
  const size_t n = order.size();
  for (auto* array : {&arrays.x0, &arrays.y0, &arrays.x1, &arrays.y1, &arrays.bound0, &arrays.bound1}) {
    array->resize(n);
  }
  for (auto* array : {&arrays.p0, &arrays.p1}) array->resize(n);
  for (auto* array : {&arrays.ray0, &arrays.ray1}) array->resize(n);
  const double focal = 0.5 * (camera.fx_px + camera.fy_px);
  const double unit = options.chi2 * options.sigma_px * options.sigma_px / (focal * focal);
  const Pyramid pyramid = options.pyramid.OfImages(camera.width_px, camera.height_px);
  std::array<double, 256> variance{};
  for (int octave = 0; octave < 256; ++octave) {
    const bool known = options.scale_by_octave && octave < pyramid.NumLevels();
    variance[static_cast<size_t>(octave)] = pyramid.SigmaSquared(known ? octave : 0);
  }
  for (size_t k = 0; k < n; ++k) {
    const Match& match = matches[order[k]];
    const Eigen::Vector3d ray0 = camera.Ray(match.uv0_px), ray1 = camera.Ray(match.uv1_px);
    arrays.x0[k] = static_cast<float>(ray0.x());
    arrays.y0[k] = static_cast<float>(ray0.y());
    arrays.x1[k] = static_cast<float>(ray1.x());
    arrays.y1[k] = static_cast<float>(ray1.y());
    arrays.bound0[k] = static_cast<float>(unit * variance[match.octave0]);
    arrays.bound1[k] = static_cast<float>(unit * variance[match.octave1]);
    arrays.ray0[k] = ray0;
    arrays.ray1[k] = ray1;
    arrays.p0[k] = ray0.head<2>();
    arrays.p1[k] = ray1.head<2>();
  }
  return arrays;
}

double NormalizedSampson(const Eigen::Matrix3d& M, const MatchArrays& arrays, size_t i) {
  const double e = arrays.ray1[i].dot(M * arrays.ray0[i]);
  const double bound = SampsonBound(M, arrays, i);
  return bound > 0 ? e * e / bound : 1e30;
}

namespace {

/// Calls `sink(i, inlier)` for all of range. Written so that the compiler makes vector code of it, for each
/// of the callers below in the instructions that it may use; without fused multiply-add all give the same
/// bits.
template <typename Sink>
[[gnu::always_inline]] inline void ForEachSampson(const Eigen::Matrix3d& Md, const MatchArrays& a,
                                                  Range range, Sink sink) {
  const Eigen::Matrix3f M = Md.cast<float>();
  const float m00 = M(0, 0), m01 = M(0, 1), m02 = M(0, 2), m10 = M(1, 0), m11 = M(1, 1), m12 = M(1, 2),
              m20 = M(2, 0), m21 = M(2, 1), m22 = M(2, 2);
  const float* const x0 = a.x0.data();
  const float* const y0 = a.y0.data();
  const float* const x1 = a.x1.data();
  const float* const y1 = a.y1.data();
  const float* const b0 = a.bound0.data();
  const float* const b1 = a.bound1.data();
  for (size_t i = range.begin; i < range.end; ++i) {
    const float lx = m00 * x0[i] + m01 * y0[i] + m02;
    const float ly = m10 * x0[i] + m11 * y0[i] + m12;
    const float lz = m20 * x0[i] + m21 * y0[i] + m22;
    const float kx = m00 * x1[i] + m10 * y1[i] + m20;
    const float ky = m01 * x1[i] + m11 * y1[i] + m21;
    const float e = x1[i] * lx + y1[i] * ly + lz;
    const float bound = b1[i] * (lx * lx + ly * ly) + b0[i] * (kx * kx + ky * ky);
    sink(i, e * e <= bound ? 1 : 0);
  }
}

/// Counts until the rest cannot bring it above `more_than`.
[[gnu::always_inline]] inline int Count(const Eigen::Matrix3d& M, const MatchArrays& arrays, Range range,
                                        int more_than) {
  constexpr size_t kAtOnce = 32;
  int count = 0;
  for (Range block = range; block.begin < range.end; block.begin = block.end) {
    if (count + static_cast<int>(range.end - block.begin) <= more_than) break;
    block.end = std::min(range.end, block.begin + kAtOnce);
    ForEachSampson(
        M, arrays, block, [&count](size_t, int inlier) __attribute__((always_inline)) { count += inlier; });
  }
  return count;
}

[[gnu::always_inline]] inline int Flag(const Eigen::Matrix3d& M, const MatchArrays& arrays, Range range,
                                       uint8_t* out) {
  int count = 0;
  ForEachSampson(
      M, arrays, range, [&count, out ](size_t i, int inlier) __attribute__((always_inline)) {
        out[i] = static_cast<uint8_t>(inlier);
        count += inlier;
      });
  return count;
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) int CountAvx2(const Eigen::Matrix3d& M, const MatchArrays& arrays,
                                              Range range, int more_than) {
  return Count(M, arrays, range, more_than);
}
__attribute__((target("avx2"))) int FlagAvx2(const Eigen::Matrix3d& M, const MatchArrays& arrays, Range range,
                                             uint8_t* out) {
  return Flag(M, arrays, range, out);
}
#endif

}  // namespace

int CountInliers(const Eigen::Matrix3d& M, const MatchArrays& arrays, Range range, int more_than,
                 [[maybe_unused]] VectorPath path) {
#if defined(__x86_64__)
  if (Takes(VectorPath::kAvx2, path)) return CountAvx2(M, arrays, range, more_than);
#endif
  return Count(M, arrays, range, more_than);
}

int FlagInliers(const Eigen::Matrix3d& M, const MatchArrays& arrays, Range range, std::span<uint8_t> flags,
                [[maybe_unused]] VectorPath path) {
#if defined(__x86_64__)
  if (Takes(VectorPath::kAvx2, path)) return FlagAvx2(M, arrays, range, flags.data());
#endif
  return Flag(M, arrays, range, flags.data());
}

int CountRotationInliers(const Eigen::Matrix3d& R, const MatchArrays& arrays, Range range) {
  int count = 0;
  for (size_t i = range.begin; i < range.end; ++i) {
    const Eigen::Vector3d moved = R * arrays.ray0[i];
    if (moved.z() <= 0) continue;
    const double dx = moved.x() / moved.z() - arrays.x1[i], dy = moved.y() / moved.z() - arrays.y1[i];
    if (dx * dx + dy * dy <= kTwoResidualsForOne * (arrays.bound0[i] + arrays.bound1[i])) ++count;
  }
  return count;
}

namespace {

template <int kSize>
std::array<int, kSize> DrawFrom(Range range, Random& random) {
  std::array<int, kSize> sample;
  DrawSample<kSize>(random, static_cast<int>(range.size()), sample);
  for (int& index : sample) index += static_cast<int>(range.begin);
  return sample;
}

}  // namespace

int SolveSample(ModelKind kind, const MatchArrays& arrays, Range range, Random& random,
                std::array<Eigen::Matrix3d, kMaxModels>& models) {
  if (kind == ModelKind::kEssential) {
    return EssentialFivePoint(arrays.ray0, arrays.ray1, DrawFrom<5>(range, random), models);
  }
  const auto F = FundamentalEightPointMinimal(arrays.p0, arrays.p1, DrawFrom<8>(range, random));
  if (!F) return 0;
  models[0] = *F;
  return 1;
}

void ChooseEssentialPose(const MatchArrays& arrays, std::span<const uint8_t> use, TwoViewModel* model) {
  std::vector<int> indices;
  for (size_t i = 0; i < use.size(); ++i) {
    if (use[i]) indices.push_back(static_cast<int>(i));
  }
  Rigid3d pose;
  PoseFromEssential(model->M, arrays.ray0, arrays.ray1, indices, pose);
  model->R = pose.rotation.toRotationMatrix();
  model->t = pose.translation.normalized();
}

namespace {

/// Levenberg and Marquardt's descent: a step that does not lower the cost is taken back and made shorter.
/// Along a valley of little parallax whole steps lead anywhere.
bool DescendEssential(const PackedMatches& matches, int iterations, double bound_scale, TwoViewModel* model) {
  constexpr double kTinyStepSquared = 1e-14;
  double damping = 1e-4;
  EssentialNormal normal = SumEssentialNormal(matches, *model, Tangent(model->t), bound_scale);
  for (int iteration = 0; iteration < iterations; ++iteration) {
    if (normal.count < 5) return false;
    const Eigen::Matrix<double, 3, 2> B = Tangent(model->t);
    Matrix5d matrix = normal.matrix;
    matrix.diagonal() *= 1.0 + damping;
    matrix.diagonal().array() += 1e-12;
    const Vector5d step = -SolveSymmetric(matrix, normal.gradient);
    if (!step.allFinite()) return false;
    TwoViewModel trial = *model;
    UpdateEssential(step, B, &trial);
    if (iteration + 1 == iterations || step.squaredNorm() < kTinyStepSquared) {  // no step follows
      const EssentialCost last = SumEssentialCost(matches, trial, bound_scale, normal.cost);
      if (last.count >= 5 && last.cost < normal.cost) *model = trial;
      break;
    }
    const EssentialNormal there =
        SumEssentialNormal(matches, trial, Tangent(trial.t), bound_scale, normal.cost);
    const bool lower = there.count >= 5 && there.cost < normal.cost;
    damping = lower ? std::max(1e-6, 0.1 * damping) : 10.0 * damping;
    if (lower) {
      *model = trial;
      normal = there;
    }
    if (damping > 1e6) break;
  }
  model->M = Hat(model->t) * model->R;
  model->M /= model->M.norm();
  return model->M.allFinite();
}

bool DescendRotation(const PackedMatches& matches, int iterations, Eigen::Matrix3d* R) {
  const UnitRays rays1(matches);
  for (int iteration = 0; iteration < iterations; ++iteration) {
    const RotationNormal normal = SumRotationNormal(matches, rays1, *R);
    const Eigen::Vector3d step = SolveSymmetric(normal.matrix, normal.gradient);
    if (!step.allFinite()) return false;
    *R = SmallRotation(step) * *R;
    if (step.squaredNorm() < 1e-14) break;
  }
  return R->allFinite();
}

}  // namespace

bool Refine(ModelKind kind, const MatchArrays& arrays, std::span<const uint8_t> use, int iterations,
            TwoViewModel* model) {
  return kind == ModelKind::kFundamental ? RefineFundamental(arrays, use, model)
                                         : RefineEssential(arrays, use, iterations, model);
}

bool RefineFundamental(const MatchArrays& arrays, std::span<const uint8_t> use, TwoViewModel* model) {
  std::vector<int> indices;
  std::vector<double> weights(use.size(), 0.0);
  for (size_t i = 0; i < use.size(); ++i) {
    if (!use[i]) continue;
    indices.push_back(static_cast<int>(i));
    weights[i] =
        arrays.bound0[0] / (static_cast<double>(arrays.bound0[i]) + static_cast<double>(arrays.bound1[i]));
  }
  const auto F = FundamentalEightPoint(arrays.p0, arrays.p1, indices, weights);
  if (!F) return false;
  model->M = *F / F->norm();
  return model->M.allFinite();
}

bool RefineEssential(const MatchArrays& arrays, std::span<const uint8_t> use, int iterations,
                     TwoViewModel* model, double bound_scale) {
  return DescendEssential(PackedMatches(arrays, use), iterations, bound_scale, model);
}

namespace {

/// Of the flags set keeps every k-th, so that at most about `most` remain.
std::vector<uint8_t> Thin(std::span<const uint8_t> use, size_t most) {
  const auto total =
      static_cast<size_t>(std::count_if(use.begin(), use.end(), [](uint8_t u) { return u != 0; }));
  const size_t stride = std::max<size_t>(1, (total + most - 1) / std::max<size_t>(1, most));
  std::vector<uint8_t> thin(use.size(), 0);
  size_t seen = 0;
  for (size_t i = 0; i < use.size(); ++i) {
    if (use[i] && seen++ % stride == 0) thin[i] = 1;
  }
  return thin;
}

double EpipolarCost(const PackedMatches& matches, const Eigen::Matrix3d& M) {
  return matches.count > 0 ? SumEpipolarCost(matches, M) / static_cast<double>(matches.count) : 1.0;
}

/// Two models whose rotations and directions are about the same.
bool SameMotion(const TwoViewModel& a, const TwoViewModel& b) {
  const double turn = std::acos(std::clamp(((a.R.transpose() * b.R).trace() - 1.0) / 2.0, -1.0, 1.0));
  return turn < 0.01 && std::abs(a.t.dot(b.t)) > std::cos(0.1);
}

}  // namespace

namespace {

/// Starts spread over the half sphere of directions (Fibonacci's spiral), with the rotation that fits best
/// alone.
void StartFromSphere(const PackedMatches& matches, int starts, std::vector<TwoViewModel>* models) {
  TwoViewModel model;
  if (!DescendRotation(matches, 10, &model.R)) return;
  for (int k = 0; k < starts; ++k) {
    const double z = (k + 0.5) / starts, phi = 2.399963229728653 * k, r = std::sqrt(1.0 - z * z);
    model.t = Eigen::Vector3d(r * std::cos(phi), r * std::sin(phi), z);
    // From coarse to fine, so that far matches pull at first.
    TwoViewModel start = model;
    if (DescendEssential(matches, 6, 100.0, &start) && DescendEssential(matches, 6, 10.0, &start)) {
      models->push_back(start);
    }
  }
}

/// The few models of lowest cost; of equal ones those that came first.
class LowestModels {
 public:
  LowestModels(const PackedMatches& matches, size_t kept) : matches_(matches), kept_(kept) {}

  void Offer(const Eigen::Matrix3d& M) {
    const bool full = ranked_.size() >= kept_;
    const double infinity = std::numeric_limits<double>::infinity();
    const double sum = SumEpipolarCost(matches_, M, full ? ranked_.back().sum : infinity);
    const double cost = sum / static_cast<double>(matches_.count);
    if (!(cost < (full ? ranked_.back().cost : infinity))) return;
    if (full) ranked_.pop_back();
    const auto place = std::upper_bound(ranked_.begin(), ranked_.end(), cost,
                                        [](double value, const Ranked& other) { return value < other.cost; });
    ranked_.insert(place, {cost, sum, M});
  }

  struct Ranked {
    double cost, sum;
    Eigen::Matrix3d M;
  };
  const std::vector<Ranked>& ranked() const { return ranked_; }

 private:
  const PackedMatches& matches_;
  size_t kept_;
  std::vector<Ranked> ranked_;  // the lowest first
};

/// Starts from the best of many samples of five.
void StartFromSamples(const MatchArrays& arrays, std::span<const uint8_t> use, const PackedMatches& packed,
                      int samples, size_t kept, Random& random, std::vector<TwoViewModel>* models) {
  std::vector<int> indices;
  for (size_t i = 0; i < use.size(); ++i) {
    if (use[i]) indices.push_back(static_cast<int>(i));
  }
  if (indices.size() < 8 || kept == 0) return;
  LowestModels lowest(packed, kept);
  std::array<Eigen::Matrix3d, kMaxModels> solutions;
  for (int k = 0; k < samples; ++k) {
    std::array<int, 5> sample;
    DrawSample<5>(random, static_cast<int>(indices.size()), sample);
    for (int& index : sample) index = indices[static_cast<size_t>(index)];
    const int count = EssentialFivePoint(arrays.ray0, arrays.ray1, sample, solutions);
    for (int s = 0; s < count; ++s) lowest.Offer(solutions[static_cast<size_t>(s)]);
  }
  for (const LowestModels::Ranked& ranked : lowest.ranked()) {
    TwoViewModel model;
    model.M = ranked.M;
    ChooseEssentialPose(arrays, use, &model);
    models->push_back(model);
  }
}

}  // namespace

std::vector<EssentialMinimum> FindEssentialMinima(const MatchArrays& arrays, std::span<const uint8_t> use,
                                                  const MinimaOptions& options, uint64_t seed) {
  const std::vector<uint8_t> thin = Thin(use, options.max_matches);
  std::vector<TwoViewModel> starts;
  const PackedMatches packed(arrays, thin);
  StartFromSphere(packed, options.directions, &starts);
  Random random(DeriveSeed(seed, 0, "essential-minima"));
  StartFromSamples(arrays, thin, packed, options.samples, options.samples_kept, random, &starts);
  std::vector<EssentialMinimum> minima;
  for (const TwoViewModel& start : starts) {
    EssentialMinimum minimum{start, 0};
    if (!DescendEssential(packed, 15, 1.0, &minimum.model)) continue;
    minimum.cost = EpipolarCost(packed, minimum.model.M);
    const auto same = std::find_if(minima.begin(), minima.end(), [&](const EssentialMinimum& other) {
      return SameMotion(other.model, minimum.model);
    });
    if (same == minima.end()) {
      minima.push_back(minimum);
    } else if (minimum.cost < same->cost) {
      *same = minimum;
    }
  }
  std::stable_sort(minima.begin(), minima.end(),
                   [](const EssentialMinimum& a, const EssentialMinimum& b) { return a.cost < b.cost; });
  return minima;
}

double DirectionSigma(const MatchArrays& arrays, std::span<const uint8_t> use, double chi2,
                      const TwoViewModel& model) {
  const Eigen::Matrix<double, 3, 2> B = Tangent(model.t);
  const Eigen::Matrix3d M = Hat(model.t) * model.R;
  Matrix5d information = Matrix5d::Zero();
  for (size_t i = 0; i < use.size(); ++i) {
    if (!use[i]) continue;
    const double variance = SampsonBound(M, arrays, i) / chi2;
    if (!(variance > 0)) continue;
    const EssentialRow row = MakeEssentialRow(model.R * arrays.ray0[i], arrays.ray1[i], model.t, B);
    information.noalias() += row.jacobian * (row.jacobian.transpose() / variance);
  }
  // Rotation eliminated.
  const Eigen::Matrix3d rotation = information.topLeftCorner<3, 3>() + 1e-9 * Eigen::Matrix3d::Identity();
  const Eigen::Matrix<double, 3, 2> mixed = information.topRightCorner<3, 2>();
  const Eigen::Matrix2d direction =
      information.bottomRightCorner<2, 2>() - mixed.transpose() * SolveSymmetric(rotation, mixed);
  const double weakest = SmallerEigenvalue(direction);
  return weakest > 0.1 ? std::min(M_PI, 1.0 / std::sqrt(weakest)) : M_PI;
}

bool RefineRotation(const MatchArrays& arrays, std::span<const uint8_t> use, int iterations,
                    Eigen::Matrix3d* R) {
  return DescendRotation(PackedMatches(arrays, use), iterations, R);
}

void StoreModel(const TwoViewModel& model, ModelKind kind, const Camera& camera, StaticSelection* selection) {
  const Eigen::Matrix3d K_inverse = camera.K().inverse();
  selection->kind = kind;
  selection->F = K_inverse.transpose() * model.M * K_inverse;
  selection->F /= selection->F.norm();
  if (kind == ModelKind::kEssential) selection->E = model.M;
}

double Spread(std::span<const Eigen::Vector2d> points_px) {
  if (points_px.empty()) return 0;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const Eigen::Vector2d& point : points_px) mean += point;
  mean /= static_cast<double>(points_px.size());
  double sum = 0;
  for (const Eigen::Vector2d& point : points_px) sum += (point - mean).squaredNorm();
  return std::sqrt(sum / static_cast<double>(points_px.size()));
}

}  // namespace dmslam
