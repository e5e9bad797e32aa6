#include "dmslam/messaging/bus_key.h"

#include <gtest/gtest.h>
#include <sys/stat.h>
#include <unistd.h>

#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <numeric>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

BusKey KeyOf(uint8_t first) {
  Bytes secret(32);
  std::iota(secret.begin(), secret.end(), first);
  return BusKey(secret);
}

const Bytes kMessage = {'h', 'e', 'l', 'l', 'o'};
constexpr char kChannel[] = "DMSLAM_X";
const Tag kTag{7, 9, 0x0123456789abcdef};

TEST(BusKey, ATagFitsItsMessageOnItsChannel) {
  const Bytes tagged = KeyOf(0).WithTag(kChannel, kMessage, kTag);
  ASSERT_EQ(tagged.size(), kMessage.size() + kTagBytes);
  EXPECT_TRUE(HasTag(tagged));
  const auto body = WithoutTag(tagged);
  EXPECT_EQ(Bytes(body.begin(), body.end()), kMessage);
  const auto tag = KeyOf(0).Verify(kChannel, tagged);
  ASSERT_TRUE(tag);
  EXPECT_EQ(tag->session, kTag.session);
  EXPECT_EQ(tag->counter, kTag.counter);
  EXPECT_EQ(tag->sender, kTag.sender);
  EXPECT_FALSE(KeyOf(0).Verify("DMSLAM_Y", tagged));
  EXPECT_FALSE(KeyOf(1).Verify(kChannel, tagged)) << "another key";
}

// What docs/security.md says of the tag, computed by another implementation.
TEST(BusKey, TheMacIsComputedAsWritten) {
  const Bytes tagged = KeyOf(0).WithTag(kChannel, kMessage, kTag);
  static constexpr char kDigits[] = "0123456789abcdef";
  std::string mac;
  for (size_t i = kMessage.size() + 20; i < kMessage.size() + 36; ++i) {
    mac += kDigits[tagged[i] / 16];
    mac += kDigits[tagged[i] % 16];
  }
  EXPECT_EQ(mac, "b49ae1cb5fdd516086c142a2378a14a5");
}

TEST(BusKey, NoByteCanBeChangedAndNoneLeftOut) {
  const BusKey key = KeyOf(0);
  const Bytes tagged = key.WithTag(kChannel, kMessage, kTag);
  for (size_t i = 0; i < tagged.size(); ++i) {
    for (int bit = 0; bit < 8; ++bit) {
      Bytes changed = tagged;
      changed[i] = static_cast<uint8_t>(changed[i] ^ (1 << bit));
      EXPECT_FALSE(key.Verify(kChannel, changed)) << "byte " << i << ", bit " << bit;
    }
    EXPECT_FALSE(key.Verify(kChannel, std::span(tagged).first(i))) << "its first " << i << " bytes";
    if (i > 0) {
      EXPECT_FALSE(key.Verify(kChannel, std::span(tagged).subspan(i))) << "without the first " << i;
    }
  }
}

TEST(BusKey, AByteThatWandersBetweenChannelAndMessageIsNoticed) {
  const BusKey key = KeyOf(0);
  Bytes tagged = key.WithTag("DMSLAM_AB", kMessage, kTag);
  tagged.insert(tagged.begin(), 'B');
  EXPECT_FALSE(key.Verify("DMSLAM_A", tagged));
}

TEST(BusKey, AMessageWithoutATagIsLeftAsItIs) {
  EXPECT_FALSE(HasTag(kMessage));
  EXPECT_EQ(WithoutTag(kMessage).size(), kMessage.size());
  EXPECT_FALSE(HasTag({}));
}

class KeyFile : public testing::Test {
 protected:
  KeyFile() : folder_(testing::TempDir() + "/dmslam_key_" + std::to_string(getpid())) {
    fs::create_directories(folder_);
    unsetenv("DMSLAM_KEY_FILE");
    unsetenv("CREDENTIALS_DIRECTORY");
  }
  ~KeyFile() override {
    fs::remove_all(folder_);
    unsetenv("DMSLAM_KEY_FILE");
    unsetenv("CREDENTIALS_DIRECTORY");
  }
  std::string Write(const std::string& content, mode_t mode) {
    const std::string path = folder_ + "/key";
    std::ofstream(path, std::ios::binary | std::ios::trunc) << content;
    EXPECT_EQ(chmod(path.c_str(), mode), 0);
    return path;
  }
  static std::string Refusal(const std::string& path) {
    try {
      BusKey::Load(path);
    } catch (const InputError& error) {
      return error.what();
    }
    return "";
  }
  static bool Same(const BusKey& a, const BusKey& b) {
    return b.Verify(kChannel, a.WithTag(kChannel, kMessage, kTag)).has_value();
  }

  std::string folder_;
  const std::string secret_ = std::string(40, 's');
};

TEST_F(KeyFile, IsReadWhereOnlyItsOwnerMay) {
  const BusKey key(std::span(reinterpret_cast<const uint8_t*>(secret_.data()), secret_.size()));
  EXPECT_TRUE(Same(key, BusKey::Load(Write(secret_, 0600))));
  EXPECT_TRUE(Same(key, BusKey::Load(Write(secret_ + "\n", 0400)))) << "a line's end does not count";
  EXPECT_FALSE(Same(key, BusKey::Load(Write(secret_ + "t", 0600))));
}

TEST_F(KeyFile, IsRefusedByNameWhereOthersMayReadIt) {
  for (const mode_t mode : {0640, 0604, 0644, 0660, 0620, 0602, 0610, 0601, 0700, 0666}) {
    const std::string path = Write(secret_, mode);
    EXPECT_NE(Refusal(path).find("chmod 600 " + path), std::string::npos)
        << std::oct << mode << Refusal(path);
  }
}

TEST_F(KeyFile, IsRefusedWhereItBelongsToAnother) {
  const std::string path = Write(secret_, 0600);
  if (chown(path.c_str(), 12345, 12345) != 0) GTEST_SKIP() << "only root can give files away";
  EXPECT_NE(Refusal(path).find("belongs to another user (12345"), std::string::npos) << Refusal(path);
}

TEST_F(KeyFile, ThatSystemdHandsOverIsRead) {
  if (geteuid() != 0) GTEST_SKIP() << "such files are root's";
  const std::string path = Write(secret_, 0440);
  EXPECT_NE(Refusal(path), "");
  setenv("CREDENTIALS_DIRECTORY", folder_.c_str(), 1);
  EXPECT_EQ(Refusal(path), "");
  EXPECT_NE(Refusal(Write(secret_, 0444)), "");
  EXPECT_NE(Refusal(folder_ + "/../" + fs::path(folder_).filename().string() + "/key"), "");
}

TEST_F(KeyFile, IsRefusedWithTheCureWhereItIsNone) {
  EXPECT_NE(Refusal(Write("too short", 0600)).find("has 9 bytes; wanted are 32 to 4096: `(umask 077;"),
            std::string::npos);
  EXPECT_NE(Refusal(Write(std::string(4097, 'x'), 0600)).find("wanted are"), std::string::npos);
  std::string long_key(4096, 'x');
  long_key.push_back('\n');
  EXPECT_EQ(Refusal(Write(long_key, 0600)), "");
  EXPECT_NE(Refusal(folder_ + "/none").find("No such file"), std::string::npos);
  EXPECT_NE(Refusal(folder_).find("is no file"), std::string::npos);
  const std::string pipe = folder_ + "/pipe";
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  EXPECT_NE(Refusal(pipe).find("is no file"), std::string::npos) << "and nobody waits for a writer";
}

TEST_F(KeyFile, IsNamedByAnOptionOrTheEnvironment) {
  EXPECT_FALSE(BusKey::LoadIfWanted(""));
  const std::string path = Write(secret_, 0600);
  EXPECT_TRUE(BusKey::LoadIfWanted(path));
  setenv("DMSLAM_KEY_FILE", path.c_str(), 1);
  EXPECT_TRUE(BusKey::LoadIfWanted(""));
  setenv("DMSLAM_KEY_FILE", "/nowhere/at/all", 1);
  EXPECT_THROW(BusKey::LoadIfWanted(""), InputError);
  EXPECT_TRUE(BusKey::LoadIfWanted(path)) << "the option counts first";
}

}  // namespace
}  // namespace dmslam
