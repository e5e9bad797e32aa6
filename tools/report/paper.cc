#include "paper.h"

#include <array>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr std::string_view kTumPage = "https://cvg.cit.tum.de/data/datasets/rgbd-dataset/download";
constexpr std::string_view kKitchenPage =
    "https://www.microsoft.com/en-us/research/project/rgb-d-dataset-7-scenes/ (7-Scenes, redkitchen, "
    "sequence 01, "
    "laid out as TUM RGB-D; its poses: https://github.com/tsattler/visloc_pseudo_gt_limitations)";
constexpr std::string_view kWalkersPage =
    "no public download page (walkers drawn into kitchen, whose images are of "
    "https://www.microsoft.com/en-us/research/project/rgb-d-dataset-7-scenes/)";
constexpr std::string_view kRendered =
    "nothing to download: scripts/reproduce.sh without --no-render renders it";

constexpr SequenceGroup kPaper = SequenceGroup::kPaper, kReal = SequenceGroup::kReal,
                        kStandIn = SequenceGroup::kStandIn, kStill = SequenceGroup::kStandInStill;

constexpr std::array<SequenceInfo, 14> kSequences = {{
    {"fr3_walking_xyz", "rgbd_dataset_freiburg3_walking_xyz", "TUM3.yaml", kPaper, "", kTumPage,
     PaperFigures{0.329, 0.143}},
    {"fr3_walking_rpy", "rgbd_dataset_freiburg3_walking_rpy", "TUM3.yaml", kPaper, "", kTumPage,
     PaperFigures{2.943, 0.106}},
    {"fr3_walking_halfsphere", "rgbd_dataset_freiburg3_walking_halfsphere", "TUM3.yaml", kPaper, "", kTumPage,
     PaperFigures{0.512, 0.155}},
    {"fr1_xyz", "rgbd_dataset_freiburg1_xyz", "TUM1.yaml", kPaper, "", kTumPage, PaperFigures{0.049, 0.029}},
    {"kitchen", "kitchen", "kitchen.yaml", kReal, "", kKitchenPage, {}},
    {"kitchen_walk1", "kitchen_walk1", "kitchen.yaml", kReal, "", kWalkersPage, {}},
    {"kitchen_walk2", "kitchen_walk2", "kitchen.yaml", kReal, "", kWalkersPage, {}},
    {"synth_walking_xyz", "synth_walking_xyz", "synthetic.yaml", kStandIn, "fr3_walking_xyz", kRendered, {}},
    {"synth_walking_rpy", "synth_walking_rpy", "synthetic.yaml", kStandIn, "fr3_walking_rpy", kRendered, {}},
    {"synth_walking_halfsphere",
     "synth_walking_halfsphere",
     "synthetic.yaml",
     kStandIn,
     "fr3_walking_halfsphere",
     kRendered,
     {}},
    {"synth_xyz", "synth_xyz", "TUM1.yaml", kStandIn, "fr1_xyz", kRendered, {}},
    {"synth_still_xyz", "synth_still_xyz", "synthetic.yaml", kStill, "fr3_walking_xyz", kRendered, {}},
    {"synth_still_rpy", "synth_still_rpy", "synthetic.yaml", kStill, "fr3_walking_rpy", kRendered, {}},
    {"synth_still_halfsphere",
     "synth_still_halfsphere",
     "synthetic.yaml",
     kStill,
     "fr3_walking_halfsphere",
     kRendered,
     {}},
}};

}  // namespace

std::span<const SequenceInfo> KnownSequences() { return kSequences; }

const SequenceInfo& FindSequence(std::string_view name) {
  for (const SequenceInfo& sequence : kSequences) {
    if (sequence.name == name) return sequence;
  }
  std::string names;
  for (const SequenceInfo& sequence : kSequences)
    names += (names.empty() ? "" : ", ") + std::string(sequence.name);
  throw InputError("no sequence is called '" + std::string(name) + "'; known: " + names);
}

}  // namespace dmslam
