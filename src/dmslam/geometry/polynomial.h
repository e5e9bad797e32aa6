#pragma once

#include <array>
#include <span>

namespace dmslam {

/// Real roots of c[0] x^3 + c[1] x^2 + c[2] x + c[3], polished by Newton steps; lower degrees where leading
/// coefficients vanish. Returns how many (0 to 3); a double root may come once or twice.
int RealRootsCubic(const std::array<double, 4>& c, std::array<double, 3>& roots);

/// Real roots of sum c[k] x^k, k = 0..10 (Sturm chain, bisection, guarded Newton). Multiple roots may be
/// missed. Returns how many, in ascending order.
int RealRootsDegree10(const std::array<double, 11>& c, std::array<double, 10>& roots);

}  // namespace dmslam
