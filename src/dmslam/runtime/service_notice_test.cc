#include "dmslam/runtime/service_notice.h"

#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>
#include <string>

namespace dmslam {
namespace {

bool Well() { return true; }

class ServiceNoticeTest : public testing::Test {
 protected:
  ServiceNoticeTest() : fd_(socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK, 0)) {
    sockaddr_un name{};
    name.sun_family = AF_UNIX;
    socklen_t length = sizeof(sa_family_t);
    EXPECT_EQ(bind(fd_, reinterpret_cast<sockaddr*>(&name), length), 0);
    length = sizeof(name);
    getsockname(fd_, reinterpret_cast<sockaddr*>(&name), &length);
    const std::string address(name.sun_path + 1, length - offsetof(sockaddr_un, sun_path) - 1);
    setenv("NOTIFY_SOCKET", ("@" + address).c_str(), 1);
    setenv("WATCHDOG_USEC", "4000000", 1);
  }
  ~ServiceNoticeTest() override {
    close(fd_);
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
  }
  std::string Heard() {
    char text[64];
    const ssize_t size = recv(fd_, text, sizeof(text), 0);
    return size < 0 ? "" : std::string(text, static_cast<size_t>(size));
  }
  int fd_;
};

TEST_F(ServiceNoticeTest, SaysThatItIsReadyAndFourTimesAPeriodThatItIsAlive) {
  ServiceNotice notice;
  notice.Ready();
  EXPECT_EQ(Heard(), "READY=1");
  notice.Ready("to be seen there");
  EXPECT_EQ(Heard(), "READY=1\nSTATUS=to be seen there");
  notice.Alive(5'000'000'000, Well);
  EXPECT_EQ(Heard(), "WATCHDOG=1");
  EXPECT_EQ(notice.deadline_ns(), 6'000'000'000);
  notice.Alive(5'999'999'999, Well);
  EXPECT_EQ(Heard(), "");
  notice.Alive(6'000'000'000, Well);
  EXPECT_EQ(Heard(), "WATCHDOG=1");
}

TEST_F(ServiceNoticeTest, SaysThatItIsAboutToEnd) {
  ServiceNotice().Stopping();
  EXPECT_EQ(Heard(), "STOPPING=1");
}

TEST_F(ServiceNoticeTest, WhoIsNotWellSaysNothingAndDoesNotSpin) {
  ServiceNotice notice;
  EXPECT_EQ(notice.longest_silence_ns(), 4'000'000'000);
  notice.Alive(5'000'000'000, [] { return false; });
  EXPECT_EQ(Heard(), "");
  EXPECT_EQ(notice.deadline_ns(), 6'000'000'000) << "a loop that waits until then turns four times a period";
  notice.Alive(6'000'000'000, Well);
  EXPECT_EQ(Heard(), "WATCHDOG=1") << "it has come to itself";
}

TEST_F(ServiceNoticeTest, SaysNothingWhereNobodyAsked) {
  unsetenv("NOTIFY_SOCKET");
  ServiceNotice notice;
  notice.Ready();
  notice.Alive(0, Well);
  EXPECT_EQ(notice.deadline_ns(), INT64_MAX);
  EXPECT_EQ(Heard(), "");
}

}  // namespace
}  // namespace dmslam
