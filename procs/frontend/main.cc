#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/load_vocabulary.h"
#include "dmslam/runtime/process_main.h"
#include "frontend/make_frontend.h"

int main(int argc, char** argv) {
  dmslam::ProcessMain process(dmslam::roles::kFrontend, "Tracks the camera and proposes keyframes.");
  dmslam::FrontendExtras extras;
  std::string vocabulary;
  process.app().AddOption("--vocabulary", vocabulary, "bag-of-words vocabulary; default: the one that ships");
  process.app().AddOption("--picture-dir", extras.picture_dir, "folder for pictures of the features");
  process.app().AddOption("--picture-every", extras.picture_every, "draw every Nth frame");
  process.app().AddOption("--frame-memory", extras.frame_memory,
                          "folder where frames wait for their last poses, so that a frontend that is started "
                          "again has them (on a disk; 130 to 270 MB a camera); default: they die with it");
  return process.Run(argc, argv, [&](dmslam::NodeContext context, const dmslam::NodeOptions& options) {
    extras.vocabulary = dmslam::LoadVocabulary(vocabulary);
    return dmslam::MakeFrontend(std::move(context), options, extras);
  });
}
