#pragma once

namespace dmslam {

/// `dmslam-eval nees ...`: how the errors of relative poses compare with what was told of them. Returns the
/// exit code.
int NeesMain(int argc, char** argv);

}  // namespace dmslam
