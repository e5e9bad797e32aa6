#include "collector/played_sequences.h"

#include <gtest/gtest.h>

#include <sstream>
#include <utility>
#include <vector>

namespace dmslam {
namespace {

EndOfSequence EndOf(CameraId camera, int64_t frames) {
  EndOfSequence end;
  end.camera_id = camera;
  end.frames_published = frames;
  end.frames_missing = 2;
  end.frames_blacked = 3;
  end.frames_jumped = 4;
  return end;
}

PlayedSequences::FramePoses PosesOf(CameraId camera, const std::vector<uint32_t>& frames) {
  PlayedSequences::FramePoses poses;
  for (const uint32_t frame : frames) poses[{camera, frame}] = FramePose();
  return poses;
}

class PlayedSequencesTest : public testing::Test {
 protected:
  void Begin(PlayedSequences& sequences) {
    sequences.NoteTo([this](const std::string& note) { notes_.push_back(note); });
  }
  /// Of the notes, by a collector after this one.
  PlayedSequences ReadByTheNext() {
    PlayedSequences next(2);
    for (const std::string& text : std::exchange(notes_, {})) {
      std::istringstream note(text);
      std::string kind;
      note >> kind;
      next.ReadNote(kind, note);
    }
    return next;
  }
  static RunRecord Fill(const PlayedSequences& sequences, const PlayedSequences::FramePoses& poses,
                        bool is_over) {
    RunRecord run;
    run.cameras.resize(2);
    sequences.Fill(poses, is_over, &run);
    return run;
  }

  PlayedSequences sequences_{2};
  std::vector<std::string> notes_;
};

TEST_F(PlayedSequencesTest, ThePlayersLastWordCounts) {
  Begin(sequences_);
  sequences_.Announce(0, 100, 7);
  sequences_.OnEnd(EndOf(0, 90));
  EXPECT_FALSE(sequences_.AllEnded()) << "the other camera goes on";
  sequences_.OnEnd(EndOf(1, 40));
  EXPECT_TRUE(sequences_.AllEnded());
  const RunRecord run = Fill(sequences_, PosesOf(0, {7, 8}), true);
  EXPECT_TRUE(run.end_heard);
  EXPECT_EQ(run.cameras[0].frames.published, 90);
  EXPECT_EQ(run.cameras[0].frames.missing, 2);
  EXPECT_EQ(run.cameras[0].frames.blacked, 3);
  EXPECT_EQ(run.cameras[0].frames.jumped, 4);
  EXPECT_EQ(run.cameras[0].frames.first_index, 7U);
  EXPECT_EQ(run.cameras[1].frames.published, 40);
}

TEST_F(PlayedSequencesTest, WhereItWasNotHeardFramesAreCountedByTheirNumbers) {
  Begin(sequences_);
  sequences_.Announce(0, 100, 0);
  const auto poses = PosesOf(0, {3, 4, 9});
  EXPECT_EQ(Fill(sequences_, poses, true).cameras[0].frames.published, 100) << "all of them were played";
  EXPECT_EQ(Fill(sequences_, poses, false).cameras[0].frames.published, 7) << "as far as it has come";
  EXPECT_EQ(Fill(sequences_, PosesOf(0, {3, 500}), false).cameras[0].frames.published, 100);
  EXPECT_EQ(Fill(sequences_, PosesOf(1, {3, 500}), true).cameras[1].frames.published, 498)
      << "a live camera announces none";
  EXPECT_FALSE(Fill(sequences_, poses, true).end_heard);
}

TEST_F(PlayedSequencesTest, FramesThatWerePlayedToAFrontendThatIsGoneCount) {
  Begin(sequences_);
  sequences_.Announce(0, 100, 0);
  for (const int64_t published : {40, 60, 2}) sequences_.OnPublished(0, published);  // it was started again
  sequences_.OnPublished(5, 10);
  const auto poses = PosesOf(0, {3, 4, 9});
  EXPECT_EQ(Fill(sequences_, poses, false).cameras[0].frames.published, 60);
  EXPECT_EQ(Fill(sequences_, PosesOf(0, {0, 79}), false).cameras[0].frames.published, 80);
  EXPECT_EQ(Fill(sequences_, poses, true).cameras[0].frames.published, 100);
  sequences_.OnEnd(EndOf(0, 70));
  EXPECT_EQ(Fill(sequences_, poses, false).cameras[0].frames.published, 70) << "its last word counts";
}

TEST_F(PlayedSequencesTest, HowManyFramesAreToComeIsKnownOfThoseThatAnnounceThem) {
  Begin(sequences_);
  sequences_.Announce(0, std::nullopt, 0);
  EXPECT_FALSE(sequences_.NumFrames());
  sequences_.Announce(0, 100, 0);
  sequences_.Announce(0, 200, 0);
  sequences_.Announce(1, 50, 0);
  EXPECT_EQ(sequences_.NumFrames(), 150);
}

TEST_F(PlayedSequencesTest, OfACameraThatIsNoneOfOursNoEndIsBelieved) {
  Begin(sequences_);
  sequences_.OnEnd(EndOf(0, 90));
  sequences_.OnEnd(EndOf(2, 90));
  EXPECT_FALSE(sequences_.AllEnded());
  EXPECT_EQ(notes_.size(), 1U);
}

TEST_F(PlayedSequencesTest, ItsNotesTellTheNextOne) {
  sequences_.Announce(0, 100, 7);
  EXPECT_TRUE(notes_.empty()) << "there is no journal yet";
  Begin(sequences_);
  sequences_.Announce(0, 100, 7);
  for (int said = 0; said < 2; ++said) sequences_.OnEnd(EndOf(1, 40));
  EXPECT_EQ(notes_.size(), 2U) << "each once";

  PlayedSequences next = ReadByTheNext();
  next.Announce(0, 300, 0);
  Begin(next);
  EXPECT_TRUE(notes_.empty()) << "what is noted already counts";
  EXPECT_EQ(next.NumFrames(), 100);
  const RunRecord run = Fill(next, {}, true);
  EXPECT_EQ(run.cameras[0].frames.published, 100);
  EXPECT_EQ(run.cameras[0].frames.first_index, 7U);
  EXPECT_EQ(run.cameras[1].frames.published, 40);
  EXPECT_EQ(run.cameras[1].frames.jumped, 4);
}

}  // namespace
}  // namespace dmslam
