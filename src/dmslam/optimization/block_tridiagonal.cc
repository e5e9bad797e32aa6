#include "dmslam/optimization/block_tridiagonal.h"

#include <algorithm>
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
struct Panel {
  Column column[kBlock];
};

[[gnu::always_inline]] inline void Load(const BlockTridiagonal& system, size_t k, Panel* panel) {
  for (int j = 0; j < kBlock; ++j) {
    Column& column = panel->column[j];
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
    Column& from = panel->column[j];
    if (!(from.Here(j) > 0.0)) return false;
    const double root = std::sqrt(from.Here(j)), inverse = 1.0 / root;
    for (int v = j / kLanes; v < kVectors; ++v) from.here[v] *= inverse;
    for (Lanes& lanes : from.below) lanes *= inverse;
    from.right *= inverse;
    from.here[j / kLanes][j % kLanes] = root;
    for (int c = j + 1; c < kBlock; ++c) {
      Column& to = panel->column[c];
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
  for (const Column& column : panel.column) {
    double below[kBlock];
    std::memcpy(below, column.below, sizeof(below));
    for (int c = 0; c < kBlock; ++c) {
      for (int i = c; i < kBlock; ++i) (*diagonal)(i, c) -= below[c] * below[i];
      (*right)[c] -= column.right * below[c];
    }
  }
}

/// Keeps of the factored columns what is needed to go back: L in the diagonal block, below^T in that above,
/// and L^-1 right.
[[gnu::always_inline]] inline void Keep(const Panel& panel, BlockTridiagonal* system, size_t k) {
  for (int j = 0; j < kBlock; ++j) {
    const Column& column = panel.column[j];
    std::memcpy(system->diagonal[k].data() + kBlock * j, column.here, sizeof(column.here));
    system->right[k][j] = column.right;
    if (k == system->above.size()) continue;
    for (int i = 0; i < kBlock; ++i) system->above[k](j, i) = column.below[i / kLanes][i % kLanes];
  }
}

/// right = L^-T right, from the last row to the first.
[[gnu::always_inline]] inline void Substitute(const Block& L, Part* right) {
  for (int j = kBlock - 1; j >= 0; --j) {
    double sum = (*right)[j];
    for (int i = j + 1; i < kBlock; ++i) sum -= L(i, j) * (*right)[i];
    (*right)[j] = sum / L(j, j);
  }
}

/// right -= above x.
[[gnu::always_inline]] inline void SubtractNext(const Block& above, const Part& x, Part* right) {
  for (int i = 0; i < kBlock; ++i) {
    for (int j = 0; j < kBlock; ++j) (*right)[j] -= above(j, i) * x[i];
  }
}

[[gnu::always_inline]] inline std::optional<double> SolveHere(BlockTridiagonal* system) {
  const size_t count = system->diagonal.size();
  Panel panel{};
  double log_determinant = 0.0;
  for (size_t k = 0; k < count; ++k) {
    Load(*system, k, &panel);
    if (!Factor(&panel)) return std::nullopt;
    for (int j = 0; j < kBlock; ++j) log_determinant += 2.0 * std::log(panel.column[j].Here(j));
    if (k + 1 < count) Eliminate(panel, &system->diagonal[k + 1], &system->right[k + 1]);
    Keep(panel, system, k);
  }
  for (size_t k = count; k-- > 0;) {
    if (k + 1 < count) SubtractNext(system->above[k], system->right[k + 1], &system->right[k]);
    Substitute(system->diagonal[k], &system->right[k]);
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
  if (Takes(VectorPath::kAvx2, path)) return SolveAvx2(system);
#endif
  return SolveHere(system);
}

}  // namespace dmslam
