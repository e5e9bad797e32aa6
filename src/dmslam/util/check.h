#pragma once

#include <stdexcept>
#include <string>

namespace dmslam {

/// Input that a user can mend: names the file, the field and the cure. `main` prints it in one line and exits
/// non-zero.
class InputError : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Input that is right by itself, and does not fit what it is used with: another vocabulary, for one.
/// Programs end with a code of its own (kExitMisfit).
class MisfitError : public InputError {
 public:
  using InputError::InputError;
};

/// A broken invariant of ours.
class InvariantError : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

[[noreturn]] void FailInvariant(const char* condition, const char* file, int line, const char* message);

}  // namespace dmslam

/// Checks an invariant in every build; throws InvariantError that names it.
#define DMSLAM_CHECK(condition, message)                                                \
  do {                                                                                  \
    if (!(condition)) ::dmslam::FailInvariant(#condition, __FILE__, __LINE__, message); \
  } while (false)
