#include "dmslam/runtime/load_vocabulary.h"
#include "dmslam/runtime/process_main.h"
#include "frontend/frontend_node.h"

int main(int argc, char** argv) {
  dmslam::ProcessMain process("frontend", "Tracks the camera and proposes keyframes.");
  dmslam::FrontendNode::Extras extras;
  std::string vocabulary;
  process.app().AddOption("--vocabulary", vocabulary, "bag-of-words vocabulary; default: the one that ships");
  process.app().AddOption("--picture-dir", extras.picture_dir, "folder for pictures of the features");
  process.app().AddOption("--picture-every", extras.picture_every, "draw every Nth frame");
  return process.Run(argc, argv, [&](dmslam::NodeContext context, dmslam::NodeOptions options) {
    extras.vocabulary = dmslam::LoadVocabulary(vocabulary);
    return std::make_unique<dmslam::FrontendNode>(std::move(context), std::move(options), extras);
  });
}
