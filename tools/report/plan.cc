#include "plan.h"

#include <algorithm>
#include <charconv>
#include <fstream>
#include <nlohmann/json.hpp>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;
using OrderedJson = nlohmann::ordered_json;

bool IsSequence(const fs::path& folder) { return fs::exists(folder / "rgb.txt"); }

// In the root itself, in the root as the sequence, or one folder deeper.
fs::path FindFolder(const fs::path& root, const std::string& name) {
  if (IsSequence(root / name)) return fs::canonical(root / name);
  if (root.filename() == name && IsSequence(root)) return fs::canonical(root);
  std::vector<fs::path> deeper;
  for (const auto& entry : fs::directory_iterator(root, fs::directory_options::skip_permission_denied)) {
    if (entry.is_directory() && IsSequence(entry.path() / name)) deeper.push_back(entry.path() / name);
  }
  std::sort(deeper.begin(), deeper.end());
  return deeper.empty() ? fs::path() : fs::canonical(deeper.front());
}

// By its folder's usual name, or by the sequence's short one.
fs::path FindFolder(const std::vector<fs::path>& roots, const SequenceInfo& info) {
  for (const fs::path& root : roots) {
    for (const std::string_view name : {info.folder, info.name}) {
      if (const fs::path folder = FindFolder(root, std::string(name)); !folder.empty()) return folder;
    }
  }
  return {};
}

void RequireFolders(const std::vector<fs::path>& roots) {
  for (const fs::path& root : roots) {
    if (!fs::is_directory(root))
      throw InputError(root.string() + ": is no folder; name the one that holds the sequences");
  }
}

void RequireGroundTruth(const fs::path& folder) {
  if (folder.empty() || fs::exists(folder / "groundtruth.txt")) return;
  throw InputError(folder.string() +
                   ": has no groundtruth.txt, so that no error can be told; unpack the sequence " +
                   "again (scripts/get_tum.sh), or leave it out with --only");
}

PlannedSequence* Find(Plan* plan, std::string_view name) {
  for (PlannedSequence& sequence : plan->sequences) {
    if (sequence.info.name == name) return &sequence;
  }
  return nullptr;
}

void InOrderOfTheTables(Plan* plan) {
  std::vector<PlannedSequence> ordered;
  for (const SequenceInfo& info : KnownSequences()) {
    if (const PlannedSequence* sequence = Find(plan, info.name)) ordered.push_back(*sequence);
  }
  plan->sequences = std::move(ordered);
}

// The largest N for which a folder of the sequence holds a finished seed_N; 0 where none does.
int LargestSeedIn(const fs::path& runs_of_sequence) {
  int largest = 0;
  std::error_code error;
  for (const auto& entry : fs::recursive_directory_iterator(runs_of_sequence, error)) {
    const std::string name = entry.path().filename().string();
    if (!entry.is_directory() || !name.starts_with("seed_")) continue;
    int seed = 0;
    const auto [end, problem] = std::from_chars(name.data() + 5, name.data() + name.size(), seed);
    if (problem == std::errc() && end == name.data() + name.size()) largest = std::max(largest, seed);
  }
  return largest;
}

std::vector<std::string> PaperProfiles() { return {"baseline", "paper", "dm"}; }

std::vector<Setting> PaperSettings() {
  return {{"features3000", "3000 features per frame, as in the paper", "features.count=3000"},
          {"defaults", "default settings", ""}};
}

// Where nobody planned anything: the runs that lie there tell.
Plan EmptyPlan(const fs::path& out) {
  if (!fs::is_directory(out / "runs")) {
    throw InputError("--out " + out.string() +
                     ": holds no runs of scripts/reproduce.sh; name the folder that its --out named");
  }
  Plan plan;
  plan.seeds = 1;
  plan.settings = PaperSettings();
  plan.profiles = PaperProfiles();
  return plan;
}

}  // namespace

fs::path RunKey::Folder() const {
  return fs::path("runs") / sequence / setting / profile / ("seed_" + std::to_string(seed));
}

Plan MakePlan(const PlanOptions& options) {
  if (options.seeds < 1) throw InputError("--seeds: write a number of at least 1");
  RequireFolders(options.roots);
  for (const std::string& name : options.only) FindSequence(name);
  Plan plan;
  plan.seeds = options.seeds;
  plan.settings = PaperSettings();
  plan.profiles = PaperProfiles();
  for (const SequenceInfo& info : KnownSequences()) {
    const bool wanted = options.only.empty() ||
                        std::find(options.only.begin(), options.only.end(), info.name) != options.only.end();
    if (!wanted) continue;
    plan.sequences.push_back({info, FindFolder(options.roots, info)});
    RequireGroundTruth(plan.sequences.back().folder);
  }
  return plan;
}

std::vector<RunKey> Runs(const Plan& plan) {
  std::vector<RunKey> runs;
  for (int seed = 1; seed <= plan.seeds; ++seed) {
    for (const Setting& setting : plan.settings) {
      for (const PlannedSequence& sequence : plan.sequences) {
        if (!sequence.present()) continue;
        for (const std::string& profile : plan.profiles) {
          runs.push_back({std::string(sequence.info.name), setting.name, profile, seed});
        }
      }
    }
  }
  return runs;
}

Plan MergePlans(const Plan& before, const Plan& now) {
  Plan merged = now;
  merged.seeds = std::max(before.seeds, now.seeds);
  for (const PlannedSequence& old : before.sequences) {
    PlannedSequence* sequence = Find(&merged, old.info.name);
    if (sequence == nullptr) {
      merged.sequences.push_back(old);
    } else if (!sequence->present()) {
      sequence->folder = old.folder;
    }
  }
  InOrderOfTheTables(&merged);
  return merged;
}

void SavePlan(const Plan& now, const fs::path& out) {
  const Plan plan = fs::exists(out / "plan.json") ? MergePlans(LoadPlan(out), now) : now;
  OrderedJson json;
  json["seeds"] = plan.seeds;
  json["profiles"] = plan.profiles;
  json["settings"] = OrderedJson::array();
  for (const Setting& setting : plan.settings) {
    json["settings"].push_back(
        {{"name", setting.name}, {"title", setting.title}, {"argument", setting.argument}});
  }
  json["sequences"] = OrderedJson::array();
  for (const PlannedSequence& sequence : plan.sequences) {
    json["sequences"].push_back(
        {{"name", sequence.info.name},
         {"folder", sequence.present() ? OrderedJson(sequence.folder.string()) : OrderedJson(nullptr)}});
  }
  std::error_code error;
  fs::create_directories(out, error);
  const fs::path part = out / "plan.json.part";  // plan.json itself is never there in halves
  std::ofstream file(part, std::ios::binary);
  file << json.dump(1) << "\n";
  file.close();
  if (file) fs::rename(part, out / "plan.json", error);
  if (!file || error) throw InputError((out / "plan.json").string() + ": cannot be written; check --out");
}

Plan LoadPlan(const fs::path& out) {
  const std::string path = (out / "plan.json").string();
  std::ifstream file(path);
  if (!file) throw InputError(path + ": cannot be opened; check --out");
  Plan plan;
  try {
    const OrderedJson json = OrderedJson::parse(file);
    plan.seeds = json.at("seeds").get<int>();
    plan.profiles = json.at("profiles").get<std::vector<std::string>>();
    for (const OrderedJson& setting : json.at("settings")) {
      plan.settings.push_back({setting.at("name").get<std::string>(), setting.at("title").get<std::string>(),
                               setting.at("argument").get<std::string>()});
    }
    for (const OrderedJson& sequence : json.at("sequences")) {
      const fs::path folder = sequence.at("folder").is_null() ? "" : sequence.at("folder").get<std::string>();
      plan.sequences.push_back({FindSequence(sequence.at("name").get<std::string>()), folder});
    }
  } catch (const nlohmann::json::exception& error) {
    throw InputError(path + ": is no plan of dmslam-report (" + error.what() + "); remove it");
  }
  return plan;
}

Plan PlanOfFolder(const fs::path& out, const std::vector<fs::path>& roots) {
  RequireFolders(roots);
  Plan plan = fs::exists(out / "plan.json") ? LoadPlan(out) : EmptyPlan(out);
  for (const SequenceInfo& info : KnownSequences()) {
    const std::string name(info.name);
    const int largest_seed = LargestSeedIn(out / "runs" / name);
    PlannedSequence* sequence = Find(&plan, name);
    if (sequence == nullptr) {
      if (largest_seed == 0) continue;
      sequence = &plan.sequences.emplace_back(PlannedSequence{info, {}});
    }
    sequence->has_runs = largest_seed > 0;
    plan.seeds = std::max(plan.seeds, largest_seed);
    if (const fs::path named = FindFolder(roots, info); !named.empty()) {
      RequireGroundTruth(named);
      sequence->folder = named;
    }
    if (IsSequence(sequence->folder)) continue;
    const fs::path rendered = out / "synthetic" / name;
    sequence->folder = IsSequence(rendered) ? fs::canonical(rendered) : fs::path();
  }
  InOrderOfTheTables(&plan);
  return plan;
}

}  // namespace dmslam
