#include <fstream>
#include <iostream>
#include <string>

#include "dmslam/console/command_line.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"
#include "message_docs.h"

int main(int argc, char** argv) {
  dmslam::CommandLine app("Writes docs/messages.md from the message definitions", "dmslam-message-docs");
  app.SetVersion(dmslam::BuildVersion());
  std::string out;
  app.AddOption("--out", out, "File to write; without it the page goes to standard output");
  return app.Run(argc, argv, [&] {
    const std::string page = dmslam::MessageDocs();
    if (out.empty()) {
      std::cout << page;
    } else if (!(std::ofstream(out) << page).flush()) {
      throw dmslam::InputError("cannot write " + out + ": is its folder there, and writable?");
    }
  });
}
