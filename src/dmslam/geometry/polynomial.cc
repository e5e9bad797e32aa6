#include "dmslam/geometry/polynomial.h"

#include <algorithm>
#include <cmath>

namespace dmslam {
namespace {

int RealRootsQuadratic(double a, double b, double c, std::array<double, 3>& roots) {
  if (std::abs(a) <= 1e-14 * (std::abs(b) + std::abs(c))) {
    if (b == 0.0) return 0;
    roots[0] = -c / b;
    return 1;
  }
  const double discriminant = b * b - 4.0 * a * c;
  if (discriminant < 0.0) return 0;
  const double q = -0.5 * (b + std::copysign(std::sqrt(discriminant), b));
  roots[0] = q / a;
  roots[1] = q != 0.0 ? c / q : 0.0;
  return 2;
}

double PolishCubicRoot(double b, double c, double d, double x) {
  for (int k = 0; k < 3; ++k) {
    const double slope = (3.0 * x + 2.0 * b) * x + c;
    if (slope == 0.0) break;
    const double step = (((x + b) * x + c) * x + d) / slope;
    x -= step;
    if (std::abs(step) <= 1e-16 * std::abs(x)) break;
  }
  return x;
}

constexpr int kMaxDegree = 10;
using Coefficients = std::array<double, kMaxDegree + 1>;

/// Sturm's chain of one polynomial, p[k] = (slope x + offset) p[k+1] - scale p[k+2], so that all of its
/// members are evaluated with a few products each.
class SturmChain {
 public:
  /// `c` has degree `degree` >= 2 and leading coefficient 1.
  SturmChain(const Coefficients& c, int degree) : polynomial_(c), degree_(degree) {
    Coefficients upper = c, lower{};
    for (int k = 1; k <= degree; ++k) lower[At(k - 1)] = c[At(k)] * k / degree;
    for (int d = degree - 1; d >= 1; --d) {
      if (!AddLink(upper, lower, d)) return;
    }
    linear_slope_ = upper[1];
    linear_offset_ = upper[0];
    last_ = lower[0];
    complete_ = true;
  }

  /// False where the chain broke off early, because the polynomial has a multiple root.
  bool complete() const { return complete_; }

  int SignChanges(double x) const {
    double below = last_, above = linear_slope_ * x + linear_offset_;
    int changes = (below < 0.0) != (above < 0.0) ? 1 : 0;
    for (int k = links_ - 1; k >= 0; --k) {
      const double next = (slope_[At(k)] * x + offset_[At(k)]) * above - scale_[At(k)] * below;
      changes += (next < 0.0) != (above < 0.0) ? 1 : 0;
      below = above;
      above = next;
    }
    return changes;
  }

  /// The single root between `low` and `high`.
  double Refine(double low, double high) const {
    double value, slope;
    Evaluate(low, value, slope);
    const bool negative_at_low = value < 0.0;
    double x = 0.5 * (low + high);
    for (int k = 0; k < 80; ++k) {
      Evaluate(x, value, slope);
      ((value < 0.0) == negative_at_low ? low : high) = x;
      double next = slope != 0.0 ? x - value / slope : low;
      if (!(next > low && next < high)) next = 0.5 * (low + high);
      const double step = std::abs(next - x);
      x = next;
      if (step <= 1e-15 * std::abs(x)) break;
    }
    return x;
  }

 private:
  static size_t At(int k) { return static_cast<size_t>(k); }

  /// One step of Euclid: divides `upper` (degree d + 1) by `lower` (degree d), and moves both on.
  bool AddLink(Coefficients& upper, Coefficients& lower, int d) {
    const double lead = lower[At(d)];
    if (std::abs(lead) < 1e-14) return false;
    const double slope = upper[At(d + 1)] / lead;
    const double offset = (upper[At(d)] - slope * lower[At(d - 1)]) / lead;
    Coefficients rest{};
    double largest = 0.0;
    for (int k = 0; k < d; ++k) {
      const double shifted = k > 0 ? slope * lower[At(k - 1)] : 0.0;
      rest[At(k)] = shifted + offset * lower[At(k)] - upper[At(k)];
      largest = std::max(largest, std::abs(rest[At(k)]));
    }
    if (!(largest > 0.0)) return false;
    for (int k = 0; k < d; ++k) rest[At(k)] /= largest;
    slope_[At(links_)] = slope;
    offset_[At(links_)] = offset;
    scale_[At(links_)] = largest;
    ++links_;
    upper = lower;
    lower = rest;
    return true;
  }

  void Evaluate(double x, double& value, double& slope) const {
    value = polynomial_[At(degree_)];
    slope = 0.0;
    for (int k = degree_ - 1; k >= 0; --k) {
      slope = slope * x + value;
      value = value * x + polynomial_[At(k)];
    }
  }

  Coefficients polynomial_;
  int degree_;
  int links_ = 0;
  bool complete_ = false;
  double linear_slope_ = 0.0, linear_offset_ = 0.0, last_ = 0.0;
  std::array<double, kMaxDegree> slope_{}, offset_{}, scale_{};
};

struct Interval {
  double low, high;
  int changes_low, changes_high;
};

int IsolateAndRefine(const SturmChain& chain, double bound, std::array<double, 10>& roots) {
  std::array<Interval, 128> stack;
  int top = 0, found = 0;
  stack[0] = {-bound, bound, chain.SignChanges(-bound), chain.SignChanges(bound)};
  while (top >= 0) {
    const Interval interval = stack[static_cast<size_t>(top--)];
    const int inside = interval.changes_low - interval.changes_high;
    if (inside <= 0) continue;
    if (inside == 1) {
      if (found < 10) roots[static_cast<size_t>(found++)] = chain.Refine(interval.low, interval.high);
      continue;
    }
    const double middle = 0.5 * (interval.low + interval.high);
    if (interval.high - interval.low < 1e-12 * (1.0 + std::abs(middle)) || top + 2 >= 128) continue;
    const int changes = chain.SignChanges(middle);
    stack[static_cast<size_t>(++top)] = {middle, interval.high, changes, interval.changes_high};
    stack[static_cast<size_t>(++top)] = {interval.low, middle, interval.changes_low, changes};
  }
  return found;
}

}  // namespace

int RealRootsCubic(const std::array<double, 4>& coefficients, std::array<double, 3>& roots) {
  const double lead = coefficients[0];
  const double size = std::abs(coefficients[1]) + std::abs(coefficients[2]) + std::abs(coefficients[3]);
  if (std::abs(lead) <= 1e-14 * size)
    return RealRootsQuadratic(coefficients[1], coefficients[2], coefficients[3], roots);
  const double b = coefficients[1] / lead, c = coefficients[2] / lead, d = coefficients[3] / lead;
  const double p = c - b * b / 3.0;
  const double q = (2.0 * b * b / 27.0 - c / 3.0) * b + d;
  const double discriminant = 0.25 * q * q + p * p * p / 27.0;
  int count;
  if (discriminant > 0.0) {
    const double root = std::sqrt(discriminant);
    const double u = std::cbrt(-0.5 * q - std::copysign(root, q));
    roots[0] = u - (u != 0.0 ? p / (3.0 * u) : 0.0) - b / 3.0;
    count = 1;
  } else {
    const double radius = 2.0 * std::sqrt(std::max(0.0, -p / 3.0));
    const double cosine = radius > 0.0 ? std::clamp(3.0 * q / (p * radius), -1.0, 1.0) : 1.0;
    const double angle = std::acos(cosine) / 3.0;
    constexpr double kThirdTurn = 2.0943951023931953;
    for (int k = 0; k < 3; ++k)
      roots[static_cast<size_t>(k)] = radius * std::cos(angle - kThirdTurn * k) - b / 3.0;
    count = 3;
  }
  for (int k = 0; k < count; ++k)
    roots[static_cast<size_t>(k)] = PolishCubicRoot(b, c, d, roots[static_cast<size_t>(k)]);
  return count;
}

int RealRootsDegree10(const std::array<double, 11>& c, std::array<double, 10>& roots) {
  double largest = 0.0;
  for (const double value : c) largest = std::max(largest, std::abs(value));
  if (!(largest > 0.0) || !std::isfinite(largest)) return 0;
  int degree = kMaxDegree;
  while (degree > 0 && std::abs(c[static_cast<size_t>(degree)]) <= 1e-14 * largest) --degree;
  if (degree == 0) return 0;
  Coefficients monic{};
  double bound = 0.0;
  for (int k = 0; k <= degree; ++k) {
    monic[static_cast<size_t>(k)] = c[static_cast<size_t>(k)] / c[static_cast<size_t>(degree)];
    // Fujiwara's bound on the size of the roots.
    if (k < degree)
      bound = std::max(bound, std::pow(std::abs(monic[static_cast<size_t>(k)]), 1.0 / (degree - k)));
  }
  bound = 2.0 * bound + 1e-9;
  if (degree == 1) {
    roots[0] = -monic[0];
    return 1;
  }
  const SturmChain chain(monic, degree);
  if (!chain.complete()) return 0;
  return IsolateAndRefine(chain, bound, roots);
}

}  // namespace dmslam
