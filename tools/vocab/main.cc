#include <string>

#include "commands.h"
#include "dmslam/console/command_line.h"
#include "dmslam/util/build_version.h"

namespace {

void AddTrain(dmslam::CommandLine& app, dmslam::TrainCommand& command) {
  dmslam::CommandLine& train = app.AddSubcommand("train", "Train a vocabulary from images");
  train.AddOption("--images", command.images, "Folder of images, or a TUM RGB-D sequence").Required();
  train.AddOption("--out", command.out, "File to write; .txt gives DBoW2's text format").Required();
  train.AddOption("--k", command.branching, "Children per node (2..64)").ShowDefault();
  train.AddOption("--levels", command.levels, "Levels below the root (1..10)").ShowDefault();
  train.AddOption("--features", command.features, "Most features per image").ShowDefault();
  train.AddOption("--min-split", command.min_split, "Nodes with fewer training features stay words")
      .ShowDefault();
  train.AddOption("--every", command.every, "Use every n-th image").ShowDefault();
  train.AddOption("--seed", command.seed, "Same images, options and seed: same vocabulary").ShowDefault();
  train.OnParsed([&command] { dmslam::Train(command); });
}

}  // namespace

int main(int argc, char** argv) {
  dmslam::CommandLine app("Trains, describes and converts bag-of-words vocabularies", "dmslam-vocab");
  app.SetVersion(dmslam::BuildVersion());
  app.RequireSubcommand();
  dmslam::TrainCommand train;
  AddTrain(app, train);
  std::string from;
  std::string to;
  dmslam::CommandLine& info = app.AddSubcommand("info", "Describe a vocabulary file");
  info.AddOption("file", from, "Vocabulary").Required();
  info.OnParsed([&] { dmslam::PrintInfo(from); });
  dmslam::CommandLine& convert =
      app.AddSubcommand("convert", "Convert between our binary format and DBoW2's text format");
  convert.AddOption("in", from, "Vocabulary to read, either format").Required();
  convert.AddOption("out", to, "File to write; .txt gives the text format").Required();
  convert.OnParsed([&] { dmslam::Convert(from, to); });
  return app.Run(argc, argv, [] {});  // the subcommands work while they are parsed
}
