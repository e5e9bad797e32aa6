// dmslam-report: what scripts/reproduce.sh has to run, and the reports of what it, scripts/sweep.sh and
// scripts/population.sh have run.
#include <algorithm>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#include "dmslam/console/command_line.h"
#include "dmslam/dataset/text_table.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"
#include "figures.h"
#include "population.h"
#include "sweep.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

struct Arguments {
  std::vector<std::string> roots;
  std::string out;
  int seeds = 10;
  std::vector<std::string> only;
  std::string publish;
  std::string data;
  std::string list;
  std::vector<std::string> runs;
  bool details = false;
};

void WriteText(const fs::path& path, const std::string& text) {
  std::ofstream file(path, std::ios::binary);
  file << text;
  file.flush();
  if (!file)
    throw InputError(path.string() + ": cannot be written; check that the folder exists and has space");
}

// The camera file that a rendered sequence brings, or the one under config/.
std::string CameraOf(const PlannedSequence& sequence) {
  const fs::path own = sequence.folder / "camera.yaml";
  return fs::exists(own) ? own.string() : "config/" + std::string(sequence.info.camera);
}

// One line per run: its folder, the sequence's folder, number of frames, camera file, profile, seed, what to
// --set ("-": nothing), and whether it is done or still to do.
void PrintRuns(const Plan& plan, const fs::path& out) {
  for (const RunKey& key : Runs(plan)) {
    const auto sequence = std::find_if(plan.sequences.begin(), plan.sequences.end(),
                                       [&](const PlannedSequence& s) { return s.info.name == key.sequence; });
    const auto setting = std::find_if(plan.settings.begin(), plan.settings.end(),
                                      [&](const Setting& s) { return s.name == key.setting; });
    const size_t frames = ReadFrameStamps((sequence->folder / "rgb.txt").string()).size();
    std::cout << key.Folder().string() << '\t' << sequence->folder.string() << '\t' << frames << '\t'
              << CameraOf(*sequence) << '\t' << key.profile << '\t' << key.seed << '\t'
              << (setting->argument.empty() ? "-" : setting->argument) << '\t'
              << (IsDone(key, out) ? "done" : "to do") << '\n';
  }
}

std::vector<fs::path> Paths(const std::vector<std::string>& names) { return {names.begin(), names.end()}; }

void RunPlan(const Arguments& arguments) {
  PlanOptions options;
  options.roots = Paths(arguments.roots);
  options.seeds = arguments.seeds;
  options.only = arguments.only;
  const Plan plan = MakePlan(options);
  SavePlan(plan, arguments.out);
  for (const PlannedSequence& sequence : plan.sequences) {
    if (!sequence.present()) {
      std::cerr << "absent: " << sequence.info.name << " (" << sequence.info.source << ")\n";
    }
  }
  PrintRuns(plan, arguments.out);
}

std::optional<IterationTimes> ReadTimes(const fs::path& path) {
  if (!fs::exists(path)) return std::nullopt;
  try {
    const auto json = nlohmann::json::parse(ReadTextFile(path.string()));
    return IterationTimes{json.at("ransac_ms").get<double>(), json.at("arsac_ms").get<double>(),
                          json.at("dlrsac_ms").get<double>(), json.at("machine").get<std::string>()};
  } catch (const nlohmann::json::exception& error) {
    throw InputError(path.string() + ": needs ransac_ms, arsac_ms, dlrsac_ms and machine (" + error.what() +
                     ")");
  }
}

bool IsRendered(const std::string& sequence) {
  const SequenceGroup group = FindSequence(sequence).group;
  return group == SequenceGroup::kStandIn || group == SequenceGroup::kStandInStill;
}

bool IsFrame(const ReportPicture& picture) {
  return picture.section == FigureSection::kSelection || picture.section == FigureSection::kFeatures;
}

// A frame's picture as JPEG: a fifth of the size of its PNG.
void CopyAsJpeg(const fs::path& from, const fs::path& to) {
  const cv::Mat picture = cv::imread(from.string());
  if (picture.empty() || !cv::imwrite(to.string(), picture, {cv::IMWRITE_JPEG_QUALITY, 85}))
    throw InputError(to.string() + ": cannot be made of " + from.string());
}

// A plot at half its size: it is drawn for paper, and the page's repository is to stay small.
void CopyAtHalfSize(const fs::path& from, const fs::path& to) {
  const cv::Mat picture = cv::imread(from.string());
  cv::Mat half;
  if (!picture.empty()) cv::resize(picture, half, {}, 0.5, 0.5, cv::INTER_AREA);
  if (half.empty() || !cv::imwrite(to.string(), half, {cv::IMWRITE_PNG_COMPRESSION, 9}))
    throw InputError(to.string() + ": cannot be made of " + from.string());
}

// What a page may show: pictures of rendered sequences, and of frames two per sequence with people.
bool IsPublished(const ReportPicture& picture, std::map<std::pair<FigureSection, std::string>, int>* frames) {
  if (picture.sequence.empty()) return true;
  if (!IsRendered(picture.sequence)) return false;
  if (!IsFrame(picture)) return true;
  return FindSequence(picture.sequence).group == SequenceGroup::kStandIn &&
         ++(*frames)[{picture.section, picture.sequence}] <= 2;
}

// The folder of the pictures of this page alone.
fs::path PicturesOf(const fs::path& page) { return page.parent_path() / "images" / page.stem(); }

// Only what an earlier --publish wrote may be written over: the page begins with the report's heading.
void RequirePage(const fs::path& page) {
  const std::string option = "--publish " + page.string() + ": ";
  if (page.extension() != ".md" || fs::is_directory(page))
    throw InputError(option + "is not the name of a page; write FOLDER/NAME.md");
  if (!fs::exists(page)) {
    if (!fs::exists(PicturesOf(page))) return;
    throw InputError(option + PicturesOf(page).string() +
                     " is there without its page, and would be lost; remove it or name another page");
  }
  if (ReadTextFile(page.string()).starts_with(std::string(kReportHeading) + "\n")) return;
  throw InputError(option + "is another page, and would be lost; name one that is not there yet, or a " +
                   "report (its first line is '" + kReportHeading + "')");
}

// The report for docs/: all numbers, but pictures of rendered sequences only, copied beside it.
void Publish(const fs::path& page, const fs::path& out, const Results& results,
             const std::optional<IterationTimes>& times, const std::vector<ReportPicture>& pictures) {
  const fs::path folder = PicturesOf(page);
  std::error_code error;
  fs::remove_all(folder, error);
  fs::create_directories(folder, error);
  std::vector<ReportPicture> copied;
  std::map<std::pair<FigureSection, std::string>, int> frames;
  for (ReportPicture picture : pictures) {
    if (!IsPublished(picture, &frames)) continue;
    fs::path name = fs::path(picture.file).filename();
    const bool named = picture.sequence.empty() || name.string().starts_with(picture.sequence);
    if (!named) name = picture.sequence + "_" + name.string();
    if (IsFrame(picture)) {
      name.replace_extension(".jpg");
      CopyAsJpeg(out / picture.file, folder / name);
    } else {
      CopyAtHalfSize(out / picture.file, folder / name);
    }
    picture.file = (fs::path("images") / page.stem() / name).string();
    copied.push_back(picture);
  }
  WriteText(page, ReportMarkdown(results, times, copied));
}

void WarnOfRunsNotShown(const Plan& plan) {
  for (const PlannedSequence& sequence : plan.sequences) {
    if (sequence.present() || !sequence.has_runs) continue;
    std::cerr
        << "dmslam-report: runs/" << sequence.info.name
        << " is not shown: the sequence is not where it was; run scripts/reproduce.sh with its folder\n";
  }
}

void RunWrite(const Arguments& arguments) {
  if (!arguments.publish.empty()) RequirePage(arguments.publish);
  const fs::path out = arguments.out;
  const Plan plan = PlanOfFolder(out, Paths(arguments.roots));
  if (!arguments.roots.empty()) SavePlan(plan, out);  // the next report finds them without being told
  const Results results = ReadResults(plan, out);
  WarnOfRunsNotShown(results.plan);
  const auto times = ReadTimes(out / "table1.json");
  const std::vector<ReportPicture> pictures = DrawPictures(results, out);
  WriteText(out / "report.md", ReportMarkdown(results, times, pictures));
  WriteText(out / "report.json", ReportJson(results, times));
  if (!arguments.publish.empty()) Publish(arguments.publish, out, results, times, pictures);
  std::cout << (out / "report.md").string() << "\n" << (out / "report.json").string() << "\n";
}

// The sweep's tables between the marks of a page, and its picture in the folder images beside that.
void PublishSweep(const fs::path& page, const Sweep& sweep, const PlotFigure& figure) {
  const std::string text = ReadTextFile(page.string());
  std::error_code error;
  fs::create_directories(page.parent_path() / "images", error);
  const std::string picture = "images/" + page.stem().string() + ".png";
  WritePng(figure, (page.parent_path() / picture).string());
  WriteText(page, ReplaceBetweenMarks(text, SweepMarkdown(sweep, picture)));
}

void RunSweep(const Arguments& arguments) {
  const fs::path out = arguments.out;
  const Sweep sweep = ReadSweep(out, arguments.data, arguments.seeds);
  const PlotFigure figure = SweepFigure(sweep);
  WritePng(figure, (out / "dynamic-scenes.png").string());
  WriteSvg(figure, (out / "dynamic-scenes.svg").string());
  WriteText(out / "dynamic-scenes.md", SweepMarkdown(sweep, "dynamic-scenes.png"));
  if (!arguments.publish.empty()) PublishSweep(arguments.publish, sweep, figure);
  std::cout << (out / "dynamic-scenes.md").string() << "\n" << (out / "dynamic-scenes.png").string() << "\n";
}

void RunPopulation(const Arguments& arguments) {
  std::vector<PopulationSystem> systems;
  for (const std::string& text : arguments.runs) systems.push_back(ParsePopulationSystem(text));
  const std::vector<PopulationSequence> sequences = ReadPopulation(arguments.list);
  for (const PopulationSequence& sequence : sequences) {
    if (!fs::exists(sequence.folder / "rgb.txt"))
      std::cerr << "dmslam-report: " << sequence.name << " is not shown: " << sequence.folder.string()
                << " holds no sequence\n";
  }
  const std::vector<PopulationRun> runs = ReadPopulationRuns(sequences, systems);
  const std::string markdown = PopulationMarkdown(runs, arguments.details);
  WriteText(arguments.out + ".md", markdown);
  WriteText(arguments.out + ".json", PopulationJson(runs, arguments.details));
  std::cout << markdown << "\nwritten: " << arguments.out << ".md, " << arguments.out << ".json\n";
}

void AddPlan(CommandLine& app, Arguments& arguments) {
  CommandLine& plan =
      app.AddSubcommand("plan", "find the sequences, add them to plan.json, print one line per run");
  plan.AddOption("--root", arguments.roots, "folder that holds sequences; may be repeated").Required();
  plan.AddOption("--out", arguments.out, "the reproduction's folder").Required();
  plan.AddOption("--seeds", arguments.seeds, "runs of each sequence").ShowDefault();
  plan.AddOption("--only", arguments.only, "only these sequences");
  plan.OnParsed([&arguments] { RunPlan(arguments); });
}

void AddWrite(CommandLine& app, Arguments& arguments) {
  CommandLine& write =
      app.AddSubcommand("write", "write report.md, report.json and pictures/ from the runs done so far");
  write.AddOption("--out", arguments.out, "the reproduction's folder").Required();
  write.AddOption("--root", arguments.roots,
                  "folder that holds sequences which are not where they were planned; may be repeated");
  write.AddOption("--publish", arguments.publish,
                  "also write this page, with pictures of rendered sequences only");
  write.OnParsed([&arguments] { RunWrite(arguments); });
}

void AddSweep(CommandLine& app, Arguments& arguments) {
  CommandLine& sweep = app.AddSubcommand("sweep", "write the tables and the picture of scripts/sweep.sh");
  sweep.AddOption("--out", arguments.out, "the sweep's folder").Required();
  sweep.AddOption("--seeds", arguments.seeds, "runs of each sequence").ShowDefault();
  sweep.AddOption("--data", arguments.data, "folder that holds the kitchen sequences");
  sweep.AddOption("--publish", arguments.publish, "also put them between this page's marks");
  sweep.OnParsed([&arguments] { RunSweep(arguments); });
}

void AddPopulation(CommandLine& app, Arguments& arguments) {
  CommandLine& population =
      app.AddSubcommand("population", "write the tables of scripts/population.sh, and print them");
  population.AddOption("--list", arguments.list, "lines of half, name, kind, folder, separated by tabs")
      .Required();
  population
      .AddOption("--runs", arguments.runs,
                 "NAME=FOLDER: a system and the folder with its runs, one per sequence; may be repeated")
      .Required();
  population.AddOption("--out", arguments.out, "writes OUT.md and OUT.json").Required();
  population.AddFlag("--details", arguments.details, "the report half's single sequences too");
  population.OnParsed([&arguments] { RunPopulation(arguments); });
}

}  // namespace
}  // namespace dmslam

int main(int argc, char** argv) {
  dmslam::CommandLine app(
      "The reproduction of the DM-SLAM paper's tables: what to run, and the report of what was run.",
      "dmslam-report");
  app.SetVersion(dmslam::BuildVersion());
  app.RequireSubcommand();
  dmslam::Arguments arguments;
  dmslam::AddPlan(app, arguments);
  dmslam::AddWrite(app, arguments);
  dmslam::AddSweep(app, arguments);
  dmslam::AddPopulation(app, arguments);
  return app.Run(argc, argv, [] {});  // the subcommands work while they are parsed
}
