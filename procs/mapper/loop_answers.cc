#include "mapper/loop_answers.h"

namespace dmslam {

std::vector<std::string> LoopAnswers::Add(LoopAnswer record, const Term& by, const Version& version) {
  const std::optional<uint64_t> correction_id = record.correction_id;
  std::optional<LoopAnswer> answer = groups_.Add(std::move(record), by);
  std::vector<std::string> problems;
  if (!groups_.abandoned().empty()) problems.push_back(groups_.abandoned());
  if (!groups_.fault().empty()) {
    problems.push_back(groups_.fault());
    lost_ = true;
    if (correction_id) broken_.push_back(*correction_id);
  }
  if (answer) whole_.push_back({std::move(*answer), version});
  return problems;
}

LoopAnswers::Answer LoopAnswers::TakeFirst() {
  Answer first = std::move(whole_.front());
  whole_.pop_front();
  return first;
}

}  // namespace dmslam
