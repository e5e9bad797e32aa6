#pragma once

#include <optional>
#include <string>

#include "dmslam/messaging/bus_key.h"
#include "landmark_proof.h"

namespace dmslam {

struct LandmarkArguments {
  ProofSource source;
  std::string id;    ///< of one landmark
  std::string json;  ///< file to write; empty: none
  bool all = false;  ///< of all landmarks, into `json`
};

/// Says what a log or a saved map proves of a landmark, or writes it of all. Returns the exit code. Throws
/// InputError, which names the file, where it knows no such landmark.
int TellLandmark(const LandmarkArguments& arguments, const std::optional<BusKey>& key);

}  // namespace dmslam
