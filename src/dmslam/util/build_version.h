#pragma once

namespace dmslam {

/// Which build this is: kVersion and, where it was made in the project's repository, "+" and the commit's
/// first ten digits ("0.1.0+0c7aa2a36b"), with "-changed" behind them where the sources were not those of the
/// commit.
const char* BuildVersion();

}  // namespace dmslam
