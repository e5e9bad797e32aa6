// dmslam-settings: writes the page of all settings.

#include <cstdio>
#include <fstream>
#include <string>

#include "dmslam/console/command_line.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"
#include "settings_page.h"

int main(int argc, char** argv) {
  dmslam::CommandLine app("Lists every setting with its default, as the page docs/configuration.md",
                          "dmslam-settings");
  app.SetVersion(dmslam::BuildVersion());
  std::string out;
  app.AddOption("--out", out, "file to write; without it the page goes to standard output");
  return app.Run(argc, argv, [&] {
    const std::string page = dmslam::SettingsPage();
    if (out.empty()) {
      std::fputs(page.c_str(), stdout);
    } else if (!(std::ofstream(out) << page).flush()) {
      throw dmslam::InputError(out + " cannot be written; is its folder there, and writable?");
    }
  });
}
