#include "frontend/frontend_work.h"

#include <gtest/gtest.h>

#include <future>
#include <vector>

#include "dmslam/camera/testing/test_camera.h"
#include "dmslam/settings/frontend_setup.h"

namespace dmslam {
namespace {

using Mode = CoreThread::Mode;

FrontendWork MakeWork(Mode mode) {
  return {FrontendSetup(LoadSettings("", {}), TestCamera(), nullptr), std::make_unique<CoreThread>(mode)};
}

MapDelta Versioned(uint64_t version) {
  MapDelta delta;
  delta.version = version;
  return delta;
}

TEST(FrontendWorkTest, ReportsAreDeliveredBeforeTheStatusThatFollowsFromTheJob) {
  for (const Mode mode : {Mode::kAtOnce, Mode::kOwnThread}) {
    FrontendWork work = MakeWork(mode);
    std::vector<int64_t> versions;
    work.Run([&] {
      work.core().ApplyMapDelta(Versioned(5));
      work.Report([&] { versions.push_back(static_cast<int64_t>(work.core().map().version())); });
    });
    work.Finish();
    EXPECT_EQ(versions, std::vector<int64_t>{5});
    EXPECT_TRUE(work.Idle());
    EXPECT_EQ(work.Status().map_version, 5);
  }
}

/// The status of a core in work is that of the job before.
TEST(FrontendWorkTest, ACoreInWorkIsNotAskedForItsStatus) {
  FrontendWork work = MakeWork(Mode::kOwnThread);
  work.Run([&] { work.core().ApplyMapDelta(Versioned(5)); });
  work.Finish();
  std::promise<void> applied, goes_on;
  const bool idle = work.Run([&] {
    work.core().ApplyMapDelta(Versioned(6));
    applied.set_value();
    goes_on.get_future().wait();
  });
  EXPECT_FALSE(idle);
  applied.get_future().wait();
  EXPECT_FALSE(work.Idle());
  EXPECT_EQ(work.Status().map_version, 5);
  goes_on.set_value();
  work.Finish();
  EXPECT_EQ(work.Status().map_version, 6);
}

TEST(FrontendWorkTest, WhatChangesBetweenJobsIsInTheStatus) {
  FrontendWork work = MakeWork(Mode::kAtOnce);
  EXPECT_TRUE(work.Run([] {}));
  work.core().ApplyMapDelta(Versioned(8));
  EXPECT_EQ(work.Status().map_version, 8);
}

}  // namespace
}  // namespace dmslam
