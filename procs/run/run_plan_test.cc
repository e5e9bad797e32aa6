#include "run/run_plan.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <limits>

#include "dmslam/util/check.h"
#include "dmslam/util/ids.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

class RunPlanTest : public testing::Test {
 protected:
  RunPlanTest() : folder_(testing::TempDir() + "/dmslam_run_" + std::to_string(getpid())) {
    fs::create_directories(folder_ + "/sequence");
    fs::create_directories(folder_ + "/log");
    arguments_.source.sequence = folder_ + "/sequence";
    arguments_.output.folder = place_.out = folder_;
    place_.programs = "/bin";
    place_.port = 20001;
  }
  ~RunPlanTest() override { fs::remove_all(folder_); }

  std::string Refusal() {
    try {
      CheckRunArguments(arguments_);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  std::vector<std::string> ArgumentsOf(const std::string& name) {
    const RunPlan plan = MakeRunPlan(arguments_, place_);
    for (const ChildSpec& child : plan.pipeline) {
      if (child.name == name) return child.arguments;
    }
    return {};
  }
  std::string Line(const std::string& name) {
    std::string line;
    for (const std::string& word : ArgumentsOf(name)) line += word + " ";
    return line;
  }

  std::string folder_;
  RunArguments arguments_;
  RunPlace place_;
};

TEST_F(RunPlanTest, RefusesWhatDoesNotFit) {
  EXPECT_EQ(Refusal(), "");
  arguments_.source.log = "there.log";
  EXPECT_NE(Refusal().find("one of"), std::string::npos);
  arguments_.source.log.clear();
  arguments_.map.localize = true;
  EXPECT_NE(Refusal().find("--localize needs a map"), std::string::npos);
  arguments_.map.localize = false;
  arguments_.settings.seed = "many";
  EXPECT_NE(Refusal().find("whole number"), std::string::npos);
  arguments_.settings.seed = "1";
  arguments_.bus.port = "80";
  EXPECT_NE(Refusal().find("between 1024 and 65535"), std::string::npos);
  arguments_.bus.port.clear();
  arguments_.source.sequence = "/nowhere/at/all";
  EXPECT_NE(Refusal().find("no such folder"), std::string::npos);
  arguments_.source.sequence = "/dev/video77";
  EXPECT_EQ(Refusal(), "") << "a camera may come later";
}

TEST_F(RunPlanTest, AFolderForTheMapThatIsNotThereIsRefusedBeforeTheRun) {
  arguments_.map.save = folder_ + "/nowhere/a.map";
  EXPECT_EQ(Refusal(), "--save-map: " + folder_ +
                           "/nowhere: no such folder, so a.map cannot be written there; make it, or choose "
                           "another folder");
  arguments_.map.save = folder_ + "/a.map";
  EXPECT_EQ(Refusal(), "");
  arguments_.output.folder = folder_ + "/new";
  for (const char* file : {"/new/a.map", "/./new/a.map"}) {
    arguments_.map.save = folder_ + file;
    EXPECT_EQ(Refusal(), "") << "the run makes the folder of its results";
  }
}

TEST_F(RunPlanTest, AFolderInTheMapsPlaceIsRefusedBeforeTheRun) {
  fs::create_directories(folder_ + "/adir");
  for (const char* out : {"", "/new"}) {
    arguments_.output.folder = folder_ + out;
    for (const std::string& path :
         {folder_ + "/adir", folder_ + "/adir/", folder_ + out, folder_ + out + "/"}) {
      arguments_.map.save = path;
      EXPECT_EQ(Refusal(), "--save-map: " + path + ": is a folder; give the name of a file");
    }
  }
}

TEST_F(RunPlanTest, AnAddressWhereNothingCanBeServedIsRefused) {
  for (const char* address : {"127.0.0.1:99999", "notanaddress", ":8080", "127.0.0.1:", "127.0.0.1:-1"}) {
    arguments_.output.http = address;
    EXPECT_EQ(Refusal(), std::string("--http ") + address +
                             ": write HOST:PORT, the port between 0 and 65535, as 127.0.0.1:8080");
  }
  for (const char* address : {"127.0.0.1:0", "[::1]:8080", "localhost:65535"}) {
    arguments_.output.http = address;
    EXPECT_EQ(Refusal(), "") << address;
  }
}

TEST_F(RunPlanTest, ASpeedThatIsNoneIsRefused) {
  for (const double speed : {0.0, -1.0, 1e-7, std::numeric_limits<double>::infinity()}) {
    arguments_.pace.speed = speed;
    EXPECT_NE(Refusal().find(": must be above zero, 0.001 or more"), std::string::npos) << speed;
  }
  arguments_.pace.speed = 0;
  EXPECT_EQ(Refusal(), "--speed 0: must be above zero, 0.001 or more; --lockstep plays as fast as it can");
  for (const double speed : {0.001, 0.5, 1000.0}) {
    arguments_.pace.speed = speed;
    EXPECT_EQ(Refusal(), "") << speed;
  }
}

TEST_F(RunPlanTest, HandsTheKeyToAllOnceItIsSafe) {
  unsetenv("DMSLAM_KEY_FILE");
  arguments_.bus.key = folder_ + "/key";
  std::ofstream(arguments_.bus.key) << std::string(40, 'k');
  fs::permissions(arguments_.bus.key, fs::perms::owner_read | fs::perms::group_read);
  EXPECT_NE(Refusal().find("chmod 600 " + arguments_.bus.key), std::string::npos) << Refusal();
  fs::permissions(arguments_.bus.key, fs::perms::owner_read | fs::perms::owner_write);
  EXPECT_EQ(Refusal(), "");
  for (const char* name : {"mapper", "loopcloser", "frontend", "collector", "player"})
    EXPECT_NE(Line(name).find("--key " + arguments_.bus.key), std::string::npos) << name;
  std::ofstream(folder_ + "/some.lcmlog") << "log";
  arguments_.source.sequence.clear();
  arguments_.source.replay = folder_ + "/some.lcmlog";
  EXPECT_NE(Refusal().find("lcm-logplayer, which has no key; --log"), std::string::npos) << Refusal();
  setenv("DMSLAM_KEY_FILE", arguments_.bus.key.c_str(), 1);
  arguments_.bus.key.clear();
  EXPECT_NE(Refusal().find("no key"), std::string::npos) << "the environment counts as well";
  unsetenv("DMSLAM_KEY_FILE");
}

TEST_F(RunPlanTest, SaysTheSameToAllAndTheRestToWhomItConcerns) {
  arguments_.settings.sets = {"features.count=1200"};
  arguments_.settings.no_loop = arguments_.pace.lockstep = true;
  arguments_.settings.profile = "baseline";
  arguments_.source.black_outs = {"10,1"};
  arguments_.map.save = "map.log";
  std::ofstream(arguments_.source.sequence + "/groundtruth.txt") << "# none\n";
  std::string session;
  for (const char* name : {"mapper", "loopcloser", "frontend", "collector", "player"}) {
    const std::string line = Line(name);
    EXPECT_EQ(line.rfind("/bin/dmslam-" + std::string(name) + " --set profile=baseline ", 0), 0u) << line;
    for (const char* part : {"--set features.count=1200 ", "--set loop.enabled=off ", "--set seed=1 ",
                             "--lcm-url udpm://239.255.76.67:20001?ttl=0&recv_buf_size=4194304 ",
                             "--peers frontend,mapper,loopcloser,collector "}) {
      EXPECT_NE(line.find(part), std::string::npos) << line;
    }
  }
  EXPECT_NE(Line("player").find("--black-out 10,1 "), std::string::npos);
  EXPECT_NE(Line("player").find("--lockstep "), std::string::npos);
  EXPECT_NE(Line("mapper").find("--save-map map.log "), std::string::npos);
  EXPECT_NE(Line("collector").find("--ground-truth "), std::string::npos);
  EXPECT_EQ(Line("frontend").find("--lockstep"), std::string::npos);
  EXPECT_NE(Line("frontend").find("--frame-memory "), std::string::npos);
  arguments_.pace.lockstep = false;
  EXPECT_EQ(Line("frontend").find("--frame-memory "), std::string::npos) << "no frame waits for a disk";
}

TEST_F(RunPlanTest, AVocabularyIsHandedToThoseWhoKnowPlaces) {
  arguments_.settings.vocabulary = folder_ + "/words.dmv";
  EXPECT_EQ(Refusal(), folder_ + "/words.dmv: no such file; check --vocabulary");
  std::ofstream(arguments_.settings.vocabulary) << "words";
  EXPECT_EQ(Refusal(), "");
  arguments_.source.others = {folder_ + "/second"};
  for (const char* name : {"loopcloser", "frontend", "frontend1"})
    EXPECT_NE(Line(name).find("--vocabulary " + folder_ + "/words.dmv "), std::string::npos) << name;
  for (const char* name : {"mapper", "collector", "player", "player1"})
    EXPECT_EQ(Line(name).find("--vocabulary"), std::string::npos) << name;
}

TEST_F(RunPlanTest, EachFurtherCameraHasAFrontendAndAPlayer) {
  EXPECT_EQ(Line("mapper").find("--cameras"), std::string::npos);
  arguments_.source.others = {folder_ + "/second", folder_ + "/third"};
  EXPECT_NE(Refusal().find("/second: no such folder"), std::string::npos);
  fs::create_directories(folder_ + "/second");
  fs::create_directories(folder_ + "/third");
  EXPECT_EQ(Refusal(), "");
  std::ofstream(folder_ + "/third/groundtruth.txt") << "# none\n";
  for (const char* name : {"mapper", "loopcloser", "collector", "frontend", "frontend1", "player2"})
    EXPECT_NE(Line(name).find("--cameras 3 "), std::string::npos) << name;
  EXPECT_EQ(ArgumentsOf("frontend2").front(), "/bin/dmslam-frontend");
  EXPECT_NE(Line("frontend2").find("--camera-id 2 "), std::string::npos);
  EXPECT_NE(Line("player1").find("--sequence " + folder_ + "/second "), std::string::npos);
  EXPECT_EQ(Line("player").find("--camera-id"), std::string::npos);
  EXPECT_NE(Line("collector").find("--ground-truth=- --ground-truth=- --ground-truth=" + folder_ + "/third"),
            std::string::npos);
  arguments_.source.others.resize(kMaxCameras, folder_ + "/second");
  EXPECT_NE(Refusal().find("at most 16"), std::string::npos);
}

TEST_F(RunPlanTest, CamerasOfOtherModelsAreToldByTheFirst) {
  arguments_.source.others = {folder_ + "/second", folder_ + "/third"};
  for (const std::string& other : arguments_.source.others) fs::create_directories(other);
  for (const char* name : {"first.yaml", "second.yaml", "third.yaml"}) std::ofstream(folder_ + "/" + name);
  arguments_.source.other_cameras = {folder_ + "/second.yaml"};
  arguments_.camera.file = folder_ + "/first.yaml";
  EXPECT_NE(Refusal().find("one for each --also"), std::string::npos);
  arguments_.source.other_cameras.push_back(folder_ + "/fourth.yaml");
  EXPECT_NE(Refusal().find("/fourth.yaml: no such file; check --also-camera"), std::string::npos);
  arguments_.source.other_cameras.back() = folder_ + "/third.yaml";
  EXPECT_EQ(Refusal(), "");
  for (const auto& [player, file] : {std::pair("player1", "/second.yaml"), {"player2", "/third.yaml"}}) {
    EXPECT_NE(Line(player).find("--camera " + folder_ + file + " "), std::string::npos);
    EXPECT_NE(Line(player).find("--as-camera " + folder_ + "/first.yaml "), std::string::npos);
  }
  EXPECT_EQ(Line("player").find("--as-camera"), std::string::npos);
}

TEST_F(RunPlanTest, SeesWhetherAPortIsTaken) {
  std::ofstream(folder_ + "/udp")
      << "   sl  local_address rem_address\n"
         "  12: 00000000:4E21 00000000:0000 07\n  13: 00000000:4E21 0100007F:4E22 07\n";
  EXPECT_TRUE(PortTaken(0x4e21, folder_));
  EXPECT_FALSE(PortTaken(0x4e22, folder_)) << "a peer's port is not ours";
}

TEST_F(RunPlanTest, TellsWhatAProcessSaidLast) {
  const std::string log = folder_ + "/log/mapper.log";
  std::ofstream(log) << "12:00:01.123 mapper info: begins\n12:00:02.000 mapper error: x.yaml: is not there\n"
                        "12:00:03.000 mapper info: ends\n";
  EXPECT_EQ(LastWords("mapper", log), "mapper: x.yaml: is not there");
  std::ofstream(log) << "12:00:01.123 mapper info: begins\ndmslam-mapper: what is --this (see --help)\n";
  EXPECT_EQ(LastWords("mapper", log), "mapper: dmslam-mapper: what is --this (see --help)");
  EXPECT_EQ(LastWords("mapper", folder_ + "/none"), "");
}

}  // namespace
}  // namespace dmslam
