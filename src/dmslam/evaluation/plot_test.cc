#include "dmslam/evaluation/plot.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <opencv2/imgcodecs.hpp>

#include "dmslam/evaluation/evaluation_test_util.h"
#include "dmslam/evaluation/trajectory_plot.h"
#include "dmslam/util/check.h"
#include "dmslam/util/testing/small_disk.h"

namespace dmslam {
namespace {

size_t Count(const std::string& text, const std::string& part) {
  size_t count = 0;
  for (size_t at = text.find(part); at != std::string::npos; at = text.find(part, at + 1)) ++count;
  return count;
}

PlotFigure OneCurve(std::vector<double> x, std::vector<double> y) {
  PlotFigure figure;
  figure.panels.resize(1);
  PlotSeries series;
  series.x = std::move(x);
  series.y = std::move(y);
  series.color = {1, 2, 3};
  figure.panels[0].series.push_back(series);
  return figure;
}

TEST(Ticks, AreRoundAndWithinTheRange) {
  for (const PlotRange range :
       {PlotRange{0, 1}, PlotRange{-3.7, 12.1}, PlotRange{1e-4, 3.3e-4}, PlotRange{980, 1e5}}) {
    for (const size_t wanted : {2u, 5u, 10u}) {
      const PlotTicks ticks = MakeTicks(range, wanted);
      ASSERT_GE(ticks.positions.size(), 1u);
      EXPECT_LE(ticks.positions.size(), wanted + 1);
      for (size_t i = 0; i < ticks.positions.size(); ++i) {
        const double slack = 1e-6 * (range.high - range.low);
        EXPECT_GE(ticks.positions[i], range.low - slack);
        EXPECT_LE(ticks.positions[i], range.high + slack);
        EXPECT_NEAR(std::stod(ticks.labels[i]), ticks.positions[i], slack);
      }
    }
  }
  EXPECT_EQ(MakeTicks({0, 1}, 5).labels,
            (std::vector<std::string>{"0.0", "0.2", "0.4", "0.6", "0.8", "1.0"}));
  EXPECT_TRUE(MakeTicks({1, 1}, 5).positions.empty());
}

TEST(Ticks, OfALogarithmicAxis) {
  EXPECT_EQ(MakeLogTicks({0.004, 0.6}).labels,
            (std::vector<std::string>{"0.005", "0.01", "0.02", "0.05", "0.1", "0.2", "0.5"}));
  EXPECT_EQ(MakeLogTicks({0.5, 20000}).labels, (std::vector<std::string>{"1", "10", "100", "1000", "10000"}));
  EXPECT_GE(MakeLogTicks({0.010, 0.015}).labels.size(), 4u);
  EXPECT_TRUE(MakeLogTicks({0, 1}).labels.empty());
}

TEST(Svg, LogarithmicAxisLeavesOutWhatIsNotPositive) {
  PlotFigure figure = OneCurve({0, 1, 2, 3, 4}, {0.01, 0.1, 0, 1, 10});
  figure.panels[0].y_log = true;
  EXPECT_EQ(Count(RenderSvg(figure), "stroke=\"#010203\""), 2u);
}

TEST(Svg, NamesAlongTheXAxis) {
  PlotFigure figure = OneCurve({0, 1}, {3, 4});
  figure.panels[0].x_categories = {"first", "second"};
  EXPECT_EQ(Count(RenderSvg(figure), ">second</text>"), 1u);
}

TEST(Svg, APointThatIsNotFiniteBreaksTheLine) {
  const double no_point = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(Count(RenderSvg(OneCurve({0, 1, 2, 3, 4}, {0, 1, 2, 1, 0})), "stroke=\"#010203\""), 1u);
  EXPECT_EQ(Count(RenderSvg(OneCurve({0, 1, 2, 3, 4}, {0, 1, no_point, 1, 0})), "stroke=\"#010203\""), 2u);
}

TEST(Svg, EscapesTextAndStaysTheSame) {
  PlotFigure figure = OneCurve({0, 1}, {0, 1});
  figure.title = "a < b & \"c\"";
  const std::string svg = RenderSvg(figure);
  EXPECT_NE(svg.find("a &lt; b &amp; &quot;c&quot;"), std::string::npos);
  EXPECT_EQ(svg, RenderSvg(figure));
  EXPECT_EQ(Count(svg, "<g "), Count(svg, "</g>"));
}

TEST(Svg, EmptyDataStillGivesAFigure) {
  EXPECT_NE(RenderSvg(OneCurve({}, {})).find("</svg>"), std::string::npos);
  EXPECT_NE(RenderSvg(OneCurve({2}, {5})).find("</svg>"), std::string::npos);
}

TEST(Plot, EqualAspectKeepsACircleRound) {
  std::vector<double> x, y;
  for (int i = 0; i <= 60; ++i) {
    x.push_back(3 * std::cos(0.1 * i) + 10);
    y.push_back(3 * std::sin(0.1 * i) - 4);
  }
  PlotFigure figure = OneCurve(x, y);
  figure.panels[0].equal_aspect = true;
  const auto path = std::filesystem::temp_directory_path() / "dmslam_plot_test_circle.png";
  WritePng(figure, path.string(), 1);
  const cv::Mat image = cv::imread(path.string());
  ASSERT_FALSE(image.empty());
  int left = image.cols, right = 0, top = image.rows, bottom = 0;
  for (int row = 0; row < image.rows; ++row) {
    for (int column = 0; column < image.cols; ++column) {
      const auto& pixel = image.at<cv::Vec3b>(row, column);
      if (pixel[0] > 20 || pixel[1] > 20 || pixel[2] > 20) continue;
      left = std::min(left, column), right = std::max(right, column);
      top = std::min(top, row), bottom = std::max(bottom, row);
    }
  }
  EXPECT_GT(right - left, 200);
  EXPECT_NEAR(right - left, bottom - top, 3);
}

TEST(Plot, UnwritableFileIsNamed) {
  const PlotFigure figure = OneCurve({0, 1}, {0, 1});
  EXPECT_THROW(WriteSvg(figure, "/nonexistent/a.svg"), InputError);
  EXPECT_THROW(WritePng(figure, "/nonexistent/a.png"), InputError);
  EXPECT_THROW(WritePng(figure, "a.nosuchformat"), InputError);
}

TEST(Plot, AFullDiskIsCalledThat) {
  const auto folder =
      std::filesystem::temp_directory_path() / ("dmslam_plot_test_" + std::to_string(getpid()));
  std::filesystem::create_directories(folder);
  const PlotFigure figure = OneCurve({0, 1}, {0, 1});
  std::string why;
  {
    const SmallDisk disk(1000);
    try {
      WritePng(figure, (folder / "a.png").string());
    } catch (const InputError& error) {
      why = error.what();
    }
  }
  EXPECT_NE(why.find("a.png: cannot be written (File too large)"), std::string::npos) << why;
  EXPECT_TRUE(std::filesystem::is_empty(folder)) << "half a picture is left";
  std::filesystem::remove_all(folder);
}

TEST(Plot, ColoursRunFromBlueToRedAndAreClamped) {
  EXPECT_GT(ColorOfValue(0).b, ColorOfValue(0).r);
  EXPECT_GT(ColorOfValue(1).r, ColorOfValue(1).b);
  EXPECT_EQ(ColorOfValue(-5).r, ColorOfValue(0).r);
  EXPECT_EQ(ColorOfValue(7).g, ColorOfValue(1).g);
}

TEST(TrajectoryPlot, FindsUpwards) {
  for (int axis = 0; axis < 3; ++axis) {
    for (const double sign : {-1.0, 1.0}) {
      // A camera whose upward image direction (-y) is the wanted axis, wobbling.
      const Eigen::Quaterniond upright =
          Eigen::Quaterniond::FromTwoVectors(Eigen::Vector3d(0, -1, 0), sign * Eigen::Vector3d::Unit(axis));
      std::vector<StampedPose> path;
      for (int i = 0; i < 20; ++i) {
        path.push_back({i, Rigid3d(ExpSo3({0.3 * std::sin(i), 0.3 * std::cos(i), 0.2}) * upright,
                                   Eigen::Vector3d::Zero())});
      }
      const UpAxis up = FindUpAxis(path);
      EXPECT_EQ(up.axis, axis);
      EXPECT_EQ(up.sign, sign);
    }
  }
}

TEST(TrajectoryPlot, DoesNotJoinAcrossGaps) {
  const auto ground_truth = CurvedPath(300);
  auto estimate = WithNoise(ground_truth, 0.01, 1);
  const auto pieces = [&] {
    const auto figure = TrajectoryFigure(ground_truth, estimate, EvaluateAte(ground_truth, estimate), "t");
    size_t breaks = 0;
    for (const double x : figure.panels[0].series[1].x) breaks += std::isnan(x) ? 1 : 0;
    return breaks + 1;
  };
  EXPECT_EQ(pieces(), 1u);
  estimate.erase(estimate.begin() + 100, estimate.begin() + 160);
  EXPECT_EQ(pieces(), 2u);
}

}  // namespace
}  // namespace dmslam
