#include "landmark_text.h"

#include <algorithm>
#include <numbers>
#include <set>

#include "dmslam/dynamics/proven.h"
#include "dmslam/util/time.h"
#include "text.h"

namespace dmslam {
namespace {

constexpr char kIndent[] = "            ";  // under the names in the margin

std::string Line(const char* name, const std::string& text) { return Format("%-12s", name) + text + "\n"; }
std::string More(const std::string& text) { return kIndent + text + "\n"; }

std::string Stamp(std::optional<int64_t> stamp_ns) {
  return stamp_ns ? FormatStampNs(*stamp_ns) : std::string("-");
}

/// The words for one landmark of one file.
class Words {
 public:
  explicit Words(const LandmarkProofs& proofs)
      : proofs_(proofs), of_several_(!proofs.of_log && proofs.Sessions().size() > 1) {}

  std::string Frame(KeyframeId id) const {
    std::string text = "frame " + std::to_string(id.frame_index());
    if (id.camera() != 0) text += " of camera " + std::to_string(id.camera());
    if (of_several_ || id.session() != proofs_.session) text += " of session " + std::to_string(id.session());
    return text;
  }
  /// "version 45 of the map, FUSED about frame 61".
  std::string Record(const MapMoment& when) const {
    const std::string version = std::to_string(when.version);
    if (when.event == MapEvent::kSnapshot)
      return proofs_.of_log ? "before version " + version + " of the map" : "before the map was saved";
    return "version " + version + " of the map, " + NameOf(when.event) +
           (when.about ? " about " + Frame(*when.about) : "");
  }
  std::string Moment(const MapMoment& when) const {
    return Record(when) + (when.stamp_ns ? ", " + FormatStampNs(*when.stamp_ns) : "");
  }
  std::string Made(const LandmarkHistory& history) const;
  std::string Gone(const LandmarkHistory& history) const;
  std::string Sights(const std::vector<LandmarkSight>& sights) const;
  std::string Former(const std::vector<FormerSight>& former) const;
  std::string Absorbed(const LandmarkHistory& history, size_t depth, std::set<LandmarkId>* told) const;

 private:
  std::string FusedInto(LandmarkId into) const;

  const LandmarkProofs& proofs_;
  const bool of_several_;  ///< of their frames none is meant when no session is named
};

std::string Words::Made(const LandmarkHistory& history) const {
  const std::string who = history.made.about ? Frame(*history.made.about) : "a keyframe";
  switch (history.origin) {
    case LandmarkOrigin::kNotTold:
      return proofs_.of_log
                 ? "before this log begins: a snapshot brought it, and the log of that run can tell"
                 : "a saved map does not tell by which decision; the log of its run does";
    case LandmarkOrigin::kFirstMap:
      if (history.made_from.empty())
        return "a point of the first map of " + who + ", gone within the same record";
      return "a point of the first map, between " + Frame(history.made_from.front().keyframe) + " and " + who;
    case LandmarkOrigin::kTriangulated:
      break;
    case LandmarkOrigin::kOther:
      return "by a record that makes none: a record before it is missing";
  }
  if (history.made_from.empty()) return "triangulated from " + who + ", and gone within the same record";
  const size_t others = history.made_from.size() - 1;
  std::string text =
      "triangulated from " + who + Format(" and %zu more keyframe%s", others, others == 1 ? "" : "s");
  if (history.widest) {
    text += "; the widest angle, with " + Frame(history.widest->keyframe) +
            Format(", is %.2f degrees", history.widest->rad * 180 / std::numbers::pi);
  }
  return text;
}

std::string Words::FusedInto(LandmarkId into) const {
  std::string text = "fused into " + NameOf(into);
  const auto& all = proofs_.histories.landmarks();
  std::set<LandmarkId> told;
  for (auto at = all.find(into); at != all.end() && told.insert(at->first).second;) {
    const std::optional<LandmarkEnd>& end = at->second.end;
    if (!end) return text + ", which is in the map";
    if (!end->into) return text + ", which was removed (" + NameOf(end->fate) + ")";
    text += ", that one into " + NameOf(*end->into);
    at = all.find(*end->into);
  }
  return text;
}

std::string Words::Gone(const LandmarkHistory& history) const {
  const LandmarkEnd& end = *history.end;
  const LandmarkEvidence evidence = end.last ? end.last->evidence : LandmarkEvidence();
  switch (end.fate) {
    case LandmarkFate::kNotTold:
      return proofs_.of_log ? "not in the map; why is not in this log"
                            : "not in the map; only the log of the run tells why";
    case LandmarkFate::kFused:
      return FusedInto(*end.into);
    case LandmarkFate::kRarelyFound:
      return Format("removed on probation: found in %u of the %u frames that should have seen it",
                    evidence.found, evidence.visible);
    case LandmarkFate::kFewObservers:
      return Format("removed on probation: no more than %zu keyframes had come to see it", end.seen.size());
    case LandmarkFate::kSeenThrough:
      return "removed: keyframes of another time see what lies behind it";
    case LandmarkFate::kMoved:
      return Format("removed: it moves: with this record the log odds went to %+.1f",
                    static_cast<double>(evidence.motion_belief));
    case LandmarkFate::kUnheld:
      return "removed by an adjustment, which left it fewer than two keyframes that see it where it is";
    case LandmarkFate::kKeyframeCulled:
      return "removed with a redundant keyframe: fewer than two others saw it";
    case LandmarkFate::kTooNear:
      return "removed at the end: just before the lens of a keyframe that sees it";
    case LandmarkFate::kUnproven:
      return "removed at the end: not proven, in a map in which somebody had stood";
    case LandmarkFate::kMapDropped:
      return "gone with its whole map" + (end.note.empty() ? "" : ": " + end.note);
    case LandmarkFate::kLeftOut:
      return "gone: what the mapper began anew with lacks it";
  }
  return "";
}

std::string Words::Sights(const std::vector<LandmarkSight>& sights) const {
  std::string text =
      More("   session camera   frame               stamp feature    x [px]    y [px] level error [px]");
  for (const LandmarkSight& sight : sights) {
    const std::string error = sight.error_px ? Format("%.2f", *sight.error_px) : "behind it";
    text += More(Format("%10u %6u %7u %19s %7u %9.2f %9.2f %5u %10s", sight.keyframe.session(),
                        sight.keyframe.camera(), sight.keyframe.frame_index(), Stamp(sight.stamp_ns).c_str(),
                        sight.feature, sight.keypoint.x_px(), sight.keypoint.y_px(), sight.keypoint.octave,
                        error.c_str()));
  }
  return text;
}

std::string Words::Former(const std::vector<FormerSight>& former) const {
  std::string text;
  for (const FormerSight& sight : former) {
    text += More(Frame(sight.sight.keyframe) + Format(", feature %u, until ", sight.sight.feature) +
                 Record(sight.until) + (sight.keyframe_culled ? ": the keyframe was culled" : ""));
  }
  return text;
}

/// With what these had absorbed, each once.
std::string Words::Absorbed(const LandmarkHistory& history, size_t depth, std::set<LandmarkId>* told) const {
  std::string text;
  for (const LandmarkFusion& fusion : history.absorbed) {
    const auto other = proofs_.histories.landmarks().find(fusion.absorbed);
    if (other == proofs_.histories.landmarks().end() || !told->insert(fusion.absorbed).second) continue;
    const std::string indent(2 * depth, ' ');
    text += More(indent + NameOf(fusion.absorbed) + ", " + Record(fusion.when));
    if (other->second.origin != LandmarkOrigin::kNotTold) text += More(indent + "  " + Made(other->second));
    text += Absorbed(other->second, depth + 1, told);
  }
  return text;
}

std::string StateText(const LandmarkProofs& proofs, const LandmarkHistory& history, const LandmarkNow& now) {
  if (!now.in_map) return Line("state", history.end ? Words(proofs).Gone(history) : "never told");
  const Landmark& landmark = proofs.map().At(history.id);
  if (!IsStatic(&landmark)) return Line("state", "in the map, moving: it has no vote");
  const bool proven = IsProven(proofs.map(), landmark, ProvenOptions());
  return Line("state",
              proven ? "in the map, static, proven: keyframes from a longer time than people stand see it"
                     : "in the map, static, not proven: not seen for longer than people stand");
}

std::string CountsText(const LandmarkEvidence& evidence) {
  const double share = evidence.visible > 0 ? 100.0 * evidence.found / evidence.visible : 0.0;
  return Format(
      "found in %u of %u frames that should see it (%.0f %%), elsewhere in %u; log odds that it moves %+.1f",
      evidence.found, evidence.visible, share, evidence.moved, static_cast<double>(evidence.motion_belief));
}

/// The first, the last, and those that brought it nearer to moving.
std::string EvidenceText(const std::vector<EvidenceStep>& steps) {
  std::string text = More(Format("%19s  version visible   found elsewhere log odds", "stamp"));
  size_t left_out = 0;
  for (size_t i = 0; i < steps.size(); ++i) {
    const LandmarkEvidence& evidence = steps[i].evidence;
    const bool moved = i > 0 && evidence.moved != steps[i - 1].evidence.moved;
    if (i != 0 && i + 1 != steps.size() && !moved) {
      ++left_out;
      continue;
    }
    text += More(Format("%19s %8llu %7u %7u %9u %8.1f", Stamp(steps[i].when.stamp_ns).c_str(),
                        static_cast<unsigned long long>(steps[i].when.version), evidence.visible,
                        evidence.found, evidence.moved, static_cast<double>(evidence.motion_belief)));
  }
  if (left_out > 0)
    text += More(Format("and %zu records between, in which no frame found it elsewhere", left_out));
  return text;
}

/// What the landmark itself says of its beginning, where nothing else tells it, or it took an older one in.
std::string AgeText(const LandmarkProofs& proofs, const LandmarkHistory& history,
                    const LandmarkState& state) {
  if (history.made.about == state.first_keyframe && history.origin != LandmarkOrigin::kNotTold) return "";
  return More("its age counts from " + Words(proofs).Frame(state.first_keyframe) + ", " +
              Stamp(state.first_ns));
}

std::string PlaceText(const LandmarkProofs& proofs, const LandmarkState& state) {
  return Line("place", Format("%.6g %.6g %.6g in map %u [map units]; follows ", state.p_world.x(),
                              state.p_world.y(), state.p_world.z(), state.map_id) +
                           Words(proofs).Frame(state.reference));
}

/// "session 5, seed 3, configuration 8078bb04eafdd3a4, profile dm".
std::string RunName(const LandmarkProofs& proofs, uint32_t session) {
  std::string text = Format("session %u", session);
  const ProvenRun* run = proofs.RunOf(session);
  if (run == nullptr) {
    const bool its_own = proofs.of_log && session == proofs.session;
    return text + (its_own
                       ? "; seed and configuration are not in the log: the frontend's first record is missing"
                       : "; seed and configuration are not in this file, but in the log of that run");
  }
  text += Format(", seed %llu, configuration %s, profile ", static_cast<unsigned long long>(run->start.seed),
                 Hex(run->start.configuration_hash).c_str()) +
          run->start.profile;
  if (!run->settings_known) text += " with settings of its own";
  if (!run->modes.empty()) text += ", " + run->modes;
  return text;
}

std::string RunText(const LandmarkProofs& proofs, uint32_t session) {
  std::string text = Line("run", RunName(proofs, session));
  const ProvenRun* run = proofs.RunOf(session);
  if (run == nullptr) return text;
  const SessionStart& start = run->start;
  return text +
         More(Format("version %s, vocabulary %s, sequence ", start.software.c_str(),
                     start.vocabulary_checksum ? Hex(*start.vocabulary_checksum).c_str() : "none") +
              start.sequence + (start.mode == PlaybackMode::kLockstep ? ", lock-step" : ", real time"));
}

/// The run of which it comes, and others that had a part in it.
std::string RunsText(const LandmarkProofs& proofs, const LandmarkHistory& history, const LandmarkNow& now) {
  const std::optional<uint32_t> made_in = proofs.SessionOf(history);
  std::string text = made_in ? RunText(proofs, *made_in)
                             : Line("run", "one of the sessions " + Listed(proofs.Sessions()) +
                                               ": of one that is gone the file does not tell in which");
  std::set<uint32_t> others;
  if (now.state) others.insert(now.state->first_keyframe.session());
  for (const std::vector<LandmarkSight>* sights : {&now.seen, &history.made_from}) {
    for (const LandmarkSight& sight : *sights) others.insert(sight.keyframe.session());
  }
  for (const uint32_t other : others) {
    if (other != made_in) text += More("frames saw it, too, of " + RunName(proofs, other));
  }
  return text;
}

std::string SightsText(const LandmarkProofs& proofs, const LandmarkHistory& history, const LandmarkNow& now) {
  const Words words(proofs);
  std::string text =
      Line(now.in_map ? "seen by" : "was seen by",
           std::to_string(now.seen.size()) + (now.seen.size() == 1 ? " keyframe" : " keyframes"));
  if (!now.seen.empty()) text += words.Sights(now.seen);
  if (!history.former.empty())
    text += Line("once seen", Format("by %zu", history.former.size())) + words.Former(history.former);
  return text;
}

}  // namespace

std::string RunsText(const LandmarkProofs& proofs) {
  std::string text;
  for (const uint32_t session : proofs.Sessions()) text += RunText(proofs, session);
  return text;
}

std::string ProofText(const LandmarkProofs& proofs, const LandmarkHistory& history) {
  const Words words(proofs);
  const LandmarkNow now = NowOf(proofs, history);
  std::string text = Line(
      "landmark", NameOf(history.id) + Format(" (%llu)", static_cast<unsigned long long>(history.id.value)));
  text += RunsText(proofs, history, now) + StateText(proofs, history, now);
  if (history.end && proofs.of_log) text += More(words.Moment(history.end->when));
  if (now.state) text += More(CountsText(now.state->evidence)) + PlaceText(proofs, *now.state);
  text += Line("made", words.Made(history));
  if (proofs.of_log) text += More(words.Moment(history.made));
  if (now.state) text += AgeText(proofs, history, *now.state);
  if (!history.made_from.empty()) text += words.Sights(history.made_from);
  std::set<LandmarkId> told = {history.id};
  if (!history.absorbed.empty())
    text += Line("took in", std::to_string(history.absorbed.size())) + words.Absorbed(history, 0, &told);
  text += SightsText(proofs, history, now);
  if (history.evidence.size() > 1)
    text += Line("evidence", Format("%zu records", history.evidence.size())) + EvidenceText(history.evidence);
  return text;
}

}  // namespace dmslam
