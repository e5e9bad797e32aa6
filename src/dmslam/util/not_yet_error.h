#pragma once

#include "dmslam/util/check.h"

namespace dmslam {

/// What is needed is not there now and may come: a multicast route, a TCP service, a camera.
class NotYetError : public InputError {
 public:
  using InputError::InputError;
};

}  // namespace dmslam
