#include <CLI/CLI.hpp>
#include <exception>
#include <iostream>
#include <string>

#include "commands.h"
#include "dmslam/util/version.h"

namespace {

void AddTrain(CLI::App& app, dmslam::TrainCommand& command) {
  CLI::App* train = app.add_subcommand("train", "Train a vocabulary from images");
  train->add_option("--images", command.images, "Folder of images, or a TUM RGB-D sequence")->required();
  train->add_option("--out", command.out, "File to write; .txt gives DBoW2's text format")->required();
  train->add_option("--k", command.branching, "Children per node (2..64)")->capture_default_str();
  train->add_option("--levels", command.levels, "Levels below the root (1..10)")->capture_default_str();
  train->add_option("--features", command.features, "Most features per image")->capture_default_str();
  train->add_option("--min-split", command.min_split, "Nodes with fewer training features stay words")
      ->capture_default_str();
  train->add_option("--every", command.every, "Use every n-th image")->capture_default_str();
  train->add_option("--seed", command.seed, "Same images, options and seed: same vocabulary")
      ->capture_default_str();
  train->callback([&command] { dmslam::Train(command); });
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Trains, describes and converts bag-of-words vocabularies", "dmslam-vocab");
  app.set_version_flag("--version", dmslam::kVersion);
  app.require_subcommand(1);
  dmslam::TrainCommand train;
  AddTrain(app, train);
  std::string from;
  std::string to;
  CLI::App* info = app.add_subcommand("info", "Describe a vocabulary file");
  info->add_option("file", from, "Vocabulary")->required();
  info->callback([&] { dmslam::PrintInfo(from); });
  CLI::App* convert =
      app.add_subcommand("convert", "Convert between our binary format and DBoW2's text format");
  convert->add_option("in", from, "Vocabulary to read, either format")->required();
  convert->add_option("out", to, "File to write; .txt gives the text format")->required();
  convert->callback([&] { dmslam::Convert(from, to); });
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::cerr << "dmslam-vocab: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
