#include "dmslam/checked_t.hpp"
#include "dmslam/wire/codec_impl.h"

namespace dmslam::wire {

template <>
struct EnumRange<LoopAnswer::Kind> {
  static constexpr auto kFirst = LoopAnswer::Kind::kNone, kLast = LoopAnswer::Kind::kGlobalAdjustment;
  static constexpr const char* kName = "unknown kind of an answer";
};

namespace {

void CorrectionFields(auto& s, auto& corrections, auto& w) {
  using Item = LoopAnswer::KeyframeCorrection;
  const auto rotation = [](int i) {
    return [i](auto& c) -> auto& { return c.corrected_from_base.rotation.coeffs()[i]; };
  };
  const auto translation = [](int i) {
    return [i](auto& c) -> auto& { return c.corrected_from_base.translation[i]; };
  };
  s.Column(corrections, w.corrected_kf, &Item::keyframe);
  s.Column(corrections, w.qx, rotation(0));
  s.Column(corrections, w.qy, rotation(1));
  s.Column(corrections, w.qz, rotation(2));
  s.Column(corrections, w.qw, rotation(3));
  s.Column(corrections, w.tx, translation(0));
  s.Column(corrections, w.ty, translation(1));
  s.Column(corrections, w.tz, translation(2));
  s.Column(
      corrections, w.scale, [](auto& c) -> auto& { return c.corrected_from_base.scale; });
}

}  // namespace

template <>
struct Codec<LoopAnswer> {
  using Wire = checked_t;
  static constexpr const char* kChannel = channels::kChecked;

  static void Fields(auto& s, auto& m, auto& w) {
    using Fusion = LoopAnswer::LandmarkFusion;
    using Offset = LoopAnswer::LandmarkOffset;
    s.Utime(m.stamp_ns, w.utime);
    s(m.kind, w.kind);
    s(m.keyframe, w.keyframe);
    s.OrMinusOne(m.stamp_ns, w.stamp_ns);
    GroupFields(s, m.group, w);
    s(m.base_version, w.base_version);
    s(m.correction_id, w.correction_id);
    s(m.seen_from, w.seen_from);
    s(m.matched, w.matched);
    s.Count(m.corrections, w.num_corrections);
    CorrectionFields(s, m.corrections, w);
    s.Count(m.fusions, w.num_fusions);
    s.Column(m.fusions, w.fuse_from, &Fusion::from);
    s.Column(m.fusions, w.fuse_into, &Fusion::into);
    s.Count(m.landmark_offsets, w.num_offsets);
    s.Column(m.landmark_offsets, w.offset_landmark, &Offset::landmark);
    s.Column(m.landmark_offsets, w.offset_x, Coordinate<0, &Offset::offset_world>());
    s.Column(m.landmark_offsets, w.offset_y, Coordinate<1, &Offset::offset_world>());
    s.Column(m.landmark_offsets, w.offset_z, Coordinate<2, &Offset::offset_world>());
    s(m.note, w.note);
  }
  static void Validate(const LoopAnswer& m, Checker& check) {
    check.Id(m.keyframe, "no keyframe");
    check.Stamp(m.stamp_ns);
    check.Group(m.group);
    check.Require(m.correction_id.has_value() == (m.kind != LoopAnswer::Kind::kNone),
                  "a correction without an id, or an id without a correction");
    const bool loop = m.kind == LoopAnswer::Kind::kLoop;
    check.Require(m.matched.has_value() == loop && m.seen_from.has_value() == loop,
                  "a loop has two ends, and nothing else has");
    check.OptionalId(m.seen_from, "impossible id of the keyframe that sees the place");
    check.OptionalId(m.matched, "impossible id of the matched keyframe");
    for (const LoopAnswer::KeyframeCorrection& correction : m.corrections) {
      check.Id(correction.keyframe, "a correction of an impossible keyframe");
      check.UnitQuaternion(correction.corrected_from_base.rotation, "a correction without a rotation");
      check.Position(correction.corrected_from_base.translation, "a correction without a translation");
      check.Scale(correction.corrected_from_base.scale, "scale of a correction out of range");
    }
    for (const LoopAnswer::LandmarkFusion& fusion : m.fusions) {
      check.Id(fusion.from, "a fusion of an impossible landmark");
      check.Id(fusion.into, "a fusion into an impossible landmark");
      check.Require(fusion.from != fusion.into, "a landmark fused into itself");
    }
    for (const LoopAnswer::LandmarkOffset& offset : m.landmark_offsets) {
      check.Id(offset.landmark, "an offset of an impossible landmark");
      check.Position(offset.offset_world, "offset of a landmark is not finite");
    }
  }
};

DMSLAM_WIRE_MESSAGE(LoopAnswer);

}  // namespace dmslam::wire
