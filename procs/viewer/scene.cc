#include "viewer/scene.h"

#include <bit>
#include <limits>

namespace dmslam {
namespace {

static_assert(std::endian::native == std::endian::little, "browsers are told little-endian words");

constexpr uint32_t kMagic = 0x56534d44;  // "DMSV"
constexpr uint32_t kLayout = 3;
constexpr uint32_t kEverything = 1;
constexpr uint32_t kGone = 0xffffffff;
constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

class Words {
 public:
  void Add(uint32_t word) { words_.push_back(word); }
  void Add(float value) { words_.push_back(std::bit_cast<uint32_t>(value)); }
  template <size_t kSize>
  void Add(const std::array<float, kSize>& values) {
    for (const float value : values) Add(value);
  }
  void Reserve(size_t words) { words_.reserve(words); }
  std::vector<uint8_t> Bytes() const {
    const auto* begin = reinterpret_cast<const uint8_t*>(words_.data());
    return {begin, begin + words_.size() * sizeof(uint32_t)};
  }

 private:
  std::vector<uint32_t> words_;
};

/// Numbers of the slots that changed after `since`; of everything only those that live.
template <typename Slots>
std::vector<uint32_t> Changed(const Slots& slots, uint64_t since) {
  std::vector<uint32_t> changed;
  for (uint32_t i = 0; i < slots.size(); ++i) {
    if (slots[i].version > since && (since > 0 || slots[i].alive)) changed.push_back(i);
  }
  return changed;
}

void AddPoints(const ViewerScene::Points& table, const std::vector<uint32_t>& changed, Words* words) {
  const auto& slots = table.slots();
  for (const uint32_t i : changed) words->Add(i);
  for (const uint32_t i : changed) words->Add(static_cast<uint32_t>(slots[i].key.value));
  for (const uint32_t i : changed) words->Add(static_cast<uint32_t>(slots[i].key.value >> 32));
  for (const uint32_t i : changed) words->Add(slots[i].value.position);
  for (const uint32_t i : changed) words->Add(slots[i].alive ? slots[i].value.belief : kNaN);
  for (const uint32_t i : changed) words->Add(slots[i].value.first_frame);
  for (const uint32_t i : changed) words->Add(slots[i].value.colour);
}

void AddKeyframes(const ViewerScene::Keyframes& table, const std::vector<uint32_t>& changed, Words* words) {
  const auto& slots = table.slots();
  for (const uint32_t i : changed) words->Add(i);
  for (const uint32_t i : changed) words->Add(slots[i].alive ? slots[i].key.frame_index() : kGone);
  for (const uint32_t i : changed) words->Add(slots[i].value.center);
  for (const uint32_t i : changed) words->Add(slots[i].value.rotation);
  for (const uint32_t i : changed) words->Add(slots[i].key.camera());
  for (const uint32_t i : changed) words->Add(slots[i].value.colour);
  uint32_t links = 0;
  for (const uint32_t i : changed) words->Add(links += static_cast<uint32_t>(slots[i].value.links.size()));
  for (const uint32_t i : changed) {
    for (const auto& link : slots[i].value.links) words->Add(link.slot);
  }
  for (const uint32_t i : changed) {
    for (const auto& link : slots[i].value.links) words->Add(static_cast<uint32_t>(link.kind));
  }
}

void AddPath(const ViewerScene::Path& table, const std::vector<uint32_t>& changed, Words* words) {
  const auto& slots = table.slots();
  for (const uint32_t i : changed) words->Add(slots[i].key.index);
  for (const uint32_t i : changed) words->Add(slots[i].key.camera);
  for (const uint32_t i : changed)
    words->Add(slots[i].alive ? slots[i].value.position : Float3{kNaN, kNaN, kNaN});
  for (const uint32_t i : changed) words->Add(slots[i].value.later ? 1U : 0U);
  for (const uint32_t i : changed) words->Add(slots[i].value.colour);
}

void AddTruth(const ViewerScene::Truth& table, const std::vector<uint32_t>& changed, Words* words) {
  const auto& slots = table.slots();
  for (const uint32_t i : changed) words->Add(slots[i].key.index);
  for (const uint32_t i : changed) words->Add(slots[i].key.camera);
  for (const uint32_t i : changed) words->Add(slots[i].value);
}

void AddCameras(const std::map<CameraId, SceneCamera>& cameras, Words* words) {
  words->Add(static_cast<uint32_t>(cameras.size()));
  for (const auto& [camera, place] : cameras) {
    words->Add(camera);
    words->Add(place.center);
    words->Add(place.rotation);
  }
}

}  // namespace

void ViewerScene::Clear() {
  points_.Clear();
  keyframes_.Clear();
  path_.Clear();
  truth_.Clear();
  cameras_.clear();
  ++generation_;
  ++arrangement_;
  ++version_;
}

std::vector<uint8_t> ViewerScene::Encode(uint32_t generation, uint64_t since) const {
  const bool everything = generation != generation_ || since == 0 || since > version_;
  if (everything) since = 0;
  const std::vector<uint32_t> points = Changed(points_.slots(), since);
  const std::vector<uint32_t> keyframes = Changed(keyframes_.slots(), since);
  const std::vector<uint32_t> path = Changed(path_.slots(), since);
  const std::vector<uint32_t> truth = Changed(truth_.slots(), since);
  size_t links = 0;
  for (const uint32_t i : keyframes) links += keyframes_.slots()[i].value.links.size();
  Words words;
  words.Reserve(10 + 9 * points.size() + 12 * keyframes.size() + 2 * links + 7 * path.size() +
                5 * truth.size() + 2 + 8 * cameras_.size());
  for (const uint32_t word : {kMagic, kLayout, generation_, everything ? kEverything : 0U}) words.Add(word);
  for (const size_t count :
       {static_cast<size_t>(version_), points.size(), keyframes.size(), links, path.size(), truth.size()}) {
    words.Add(static_cast<uint32_t>(count));
  }
  AddPoints(points_, points, &words);
  AddKeyframes(keyframes_, keyframes, &words);
  AddPath(path_, path, &words);
  AddTruth(truth_, truth, &words);
  words.Add(arrangement_);
  AddCameras(cameras_, &words);
  return words.Bytes();
}

}  // namespace dmslam
