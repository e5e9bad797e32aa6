#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/load_vocabulary.h"
#include "dmslam/runtime/process_main.h"
#include "loopcloser/make_loopcloser.h"

int main(int argc, char** argv) {
  dmslam::ProcessMain process(dmslam::roles::kLoopCloser, "Keeps a replica of the map and closes loops.");
  std::string vocabulary;
  process.app().AddOption("--vocabulary", vocabulary, "bag-of-words vocabulary; default: the one that ships");
  return process.Run(argc, argv, [&](dmslam::NodeContext context, dmslam::NodeOptions options) {
    return dmslam::MakeLoopcloser(std::move(context), std::move(options), dmslam::LoadVocabulary(vocabulary));
  });
}
