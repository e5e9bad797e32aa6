#include <CLI/CLI.hpp>
#include <exception>
#include <fstream>
#include <iostream>
#include <string>

#include "dmslam/util/check.h"
#include "dmslam/util/version.h"
#include "message_docs.h"

int main(int argc, char** argv) {
  CLI::App app("Writes docs/messages.md from the message definitions", "dmslam-message-docs");
  app.set_version_flag("--version", dmslam::kVersion);
  std::string out;
  app.add_option("--out", out, "File to write; without it the page goes to standard output");
  try {
    app.parse(argc, argv);
    const std::string page = dmslam::MessageDocs();
    if (out.empty()) {
      std::cout << page;
    } else if (!(std::ofstream(out) << page).flush()) {
      throw dmslam::InputError("cannot write " + out + ": is its folder there, and writable?");
    }
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::cerr << "dmslam-message-docs: " << error.what() << '\n';
    return 1;
  }
  return 0;
}
