#include "dmslam/optimization/block_tridiagonal.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

namespace dmslam {
namespace {

constexpr int kBlock = BlockTridiagonal::kBlock, kLanes = 4;
constexpr int kVectors = kBlock / kLanes;  // of one block's rows
static_assert(kBlock % kLanes == 0);

using Block = BlockTridiagonal::Block;
using Part = BlockTridiagonal::Part;
// The compiler would align it as the baseline needs it.
using Lanes = double __attribute__((vector_size(sizeof(double) * kLanes), aligned(sizeof(double) * kLanes)));

/// Of the rows of one block, of those of the next, and of the right side, which is one more row.
struct Column {
  Lanes here[kVectors], below[kVectors];
  double right;

  double Here(int i) const { return here[i / kLanes][i % kLanes]; }
};

/// What eliminates one block: the columns of A from the diagonal down. Factored, they are those of the
/// Cholesky factor L, and of L^-1 right.
using Panel = std::array<Column, kBlock>;

[[gnu::always_inline]] inline void Load(const BlockTridiagonal& system, size_t k, Panel* panel) {
  for (int j = 0; j < kBlock; ++j) {
    Column& column = (*panel)[j];
    for (int i = j; i < kBlock; ++i) column.here[i / kLanes][i % kLanes] = system.diagonal[k](i, j);
    if (k < system.above.size()) {
      for (int i = 0; i < kBlock; ++i) column.below[i / kLanes][i % kLanes] = system.above[k](j, i);
    }
    column.right = system.right[k][j];
  }
}

/// Whether the diagonal block is positive definite. What lies above the diagonal is not looked at.
[[gnu::always_inline]] inline bool Factor(Panel* panel) {
  for (int j = 0; j < kBlock; ++j) {
    Column& from = (*panel)[j];
    if (!(from.Here(j) > 0.0)) return false;
    const double root = std::sqrt(from.Here(j)), inverse = 1.0 / root;
    for (int v = j / kLanes; v < kVectors; ++v) from.here[v] *= inverse;
    for (Lanes& lanes : from.below) lanes *= inverse;
    from.right *= inverse;
    from.here[j / kLanes][j % kLanes] = root;
    for (int c = j + 1; c < kBlock; ++c) {
      Column& to = (*panel)[c];
      const double times = from.Here(c);
      for (int v = c / kLanes; v < kVectors; ++v) to.here[v] -= times * from.here[v];
      for (int v = 0; v < kVectors; ++v) to.below[v] -= times * from.below[v];
      to.right -= times * from.right;
    }
  }
  return true;
}

/// Takes what is eliminated out of the next block.
[[gnu::always_inline]] inline void Eliminate(const Panel& panel, Block* diagonal, Part* right) {
  for (const Column& column : panel) {
    double below[kBlock];
    std::memcpy(below, column.below, sizeof(below));
    for (int c = 0; c < kBlock; ++c) {
      for (int i = c; i < kBlock; ++i) (*diagonal)(i, c) -= below[c] * below[i];
      (*right)[c] -= column.right * below[c];
    }
  }
}

/// x(k) = L^-T (L^-1 right - below^T x(k + 1)), from the last row to the first.
[[gnu::always_inline]] inline void Substitute(const Panel& panel, const Part& next, Part* x) {
  Lanes known[2 * kVectors] = {};  // of this block's rows none at first
  std::memcpy(known + kVectors, next.data(), sizeof(Part));
  for (int j = kBlock - 1; j >= 0; --j) {
    const Column& column = panel[j];
    Lanes sum = {};
    for (int v = j / kLanes; v < kVectors; ++v) sum += column.here[v] * known[v];
    for (int v = 0; v < kVectors; ++v) sum += column.below[v] * known[kVectors + v];
    known[j / kLanes][j % kLanes] = (column.right - ((sum[0] + sum[1]) + (sum[2] + sum[3]))) / column.Here(j);
  }
  std::memcpy(x->data(), known, sizeof(Part));
}

[[gnu::always_inline]] inline std::optional<double> SolveHere(BlockTridiagonal* system) {
  const size_t count = system->diagonal.size();
  std::vector<Panel> panels(count);
  double log_determinant = 0.0;
  for (size_t k = 0; k < count; ++k) {
    Load(*system, k, &panels[k]);
    if (!Factor(&panels[k])) return std::nullopt;
    for (int j = 0; j < kBlock; ++j) log_determinant += 2.0 * std::log(panels[k][j].Here(j));
    if (k + 1 < count) Eliminate(panels[k], &system->diagonal[k + 1], &system->right[k + 1]);
  }
  Part next = Part::Zero();
  for (size_t k = count; k-- > 0;) {
    Substitute(panels[k], next, &system->right[k]);
    next = system->right[k];
  }
  const bool finite = std::isfinite(log_determinant) &&
                      std::ranges::all_of(system->right, [](const Part& x) { return x.allFinite(); });
  return finite ? std::optional(log_determinant) : std::nullopt;
}

#if defined(__x86_64__)
__attribute__((target("avx2"))) std::optional<double> SolveAvx2(BlockTridiagonal* system) {
  return SolveHere(system);
}
#endif

}  // namespace

std::optional<double> Solve(BlockTridiagonal* system, [[maybe_unused]] VectorPath path) {
#if defined(__x86_64__)
  if (path == VectorPath::kAvx2 && HasAvx2()) return SolveAvx2(system);
#endif
  return SolveHere(system);
}

}  // namespace dmslam
