// Runs a fuzz target on mutations of its seeds; needs no clang and always does the same. With a sanitizer it
// finds what a short run of libFuzzer would.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cstdint>
#include <exception>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <iterator>
#include <string>
#include <vector>

#include "dmslam/util/check.h"
#include "dmslam/util/random.h"
#include "dmslam/util/version.h"
#include "fuzz_target.h"

namespace {

using Bytes = std::vector<uint8_t>;

struct Options {
  uint64_t count = 1000;
  uint64_t seed = 1;
  std::string write_seeds;
  std::vector<std::string> files;
};

uint32_t Below(dmslam::Random& random, size_t bound) { return random.Below(static_cast<uint32_t>(bound)); }

void OverwriteInteger(Bytes& bytes, dmslam::Random& random) {
  constexpr std::array<uint32_t, 8> kValues = {0,          1,          0xffffffff, 0x7fffffff,
                                               0x80000000, 0x10000000, 0x40000000, 65536};
  if (bytes.size() < 4) return;
  const size_t at = Below(random, bytes.size() - 3);
  const uint32_t value = kValues[random.Below(8)];
  for (size_t i = 0; i < 4; ++i) bytes[at + i] = static_cast<uint8_t>(value >> (24 - 8 * i));
}

Bytes Mutate(const std::vector<Bytes>& seeds, dmslam::Random& random) {
  Bytes bytes = seeds[Below(random, seeds.size())];
  for (uint32_t n = 1 + random.Below(3); n > 0; --n) {
    if (bytes.empty()) bytes.push_back(0);
    const size_t at = Below(random, bytes.size());
    switch (random.Below(5)) {
      case 0:  // one to sixteen bytes changed
        for (uint32_t k = 1 + random.Below(16); k > 0; --k)
          bytes[Below(random, bytes.size())] = static_cast<uint8_t>(random.Next());
        break;
      case 1:
        OverwriteInteger(bytes, random);
        break;
      case 2:
        bytes.resize(at);
        break;
      case 3:
        bytes.insert(bytes.begin() + static_cast<ptrdiff_t>(at), 1 + random.Below(8),
                     static_cast<uint8_t>(random.Next()));
        break;
      default: {  // the end of another seed
        const Bytes& other = seeds[Below(random, seeds.size())];
        bytes.resize(at);
        if (other.size() > at)
          bytes.insert(bytes.end(), other.begin() + static_cast<ptrdiff_t>(at), other.end());
      }
    }
  }
  return bytes;
}

void Run(const Options& options) {
  const std::vector<Bytes> seeds = dmslam::fuzz::Seeds();
  if (!options.write_seeds.empty()) {
    std::filesystem::create_directories(options.write_seeds);
    for (size_t i = 0; i < seeds.size(); ++i) {
      std::ofstream file(options.write_seeds + "/seed" + std::to_string(i), std::ios::binary);
      file.write(reinterpret_cast<const char*>(seeds[i].data()),
                 static_cast<std::streamsize>(seeds[i].size()));
      if (!file.flush()) throw dmslam::InputError("cannot write into " + options.write_seeds);
    }
    return;
  }
  for (const std::string& path : options.files) {
    std::ifstream file(path, std::ios::binary);
    if (!file) throw dmslam::InputError("cannot read " + path);
    const Bytes bytes(std::istreambuf_iterator<char>(file), {});
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
  if (!options.files.empty()) return;
  for (const Bytes& seed : seeds) LLVMFuzzerTestOneInput(seed.data(), seed.size());
  dmslam::Random random(options.seed);
  for (uint64_t i = 0; i < options.count; ++i) {
    const Bytes bytes = Mutate(seeds, random);
    LLVMFuzzerTestOneInput(bytes.data(), bytes.size());
  }
  std::cout << options.count << " mutations, no finding\n";
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Feeds mutated inputs to one reader of bytes from outside");
  app.set_version_flag("--version", dmslam::kVersion);
  Options options;
  app.add_option("--count", options.count, "How many mutations")->capture_default_str();
  app.add_option("--seed", options.seed, "Same seed: same mutations")->capture_default_str();
  app.add_option("--write-seeds", options.write_seeds,
                 "Only write the seeds into this folder, for libFuzzer");
  app.add_option("files", options.files, "Run on these files instead");
  try {
    app.parse(argc, argv);
    Run(options);
  } catch (const CLI::ParseError& error) {
    return app.exit(error);
  } catch (const std::exception& error) {
    std::cerr << error.what() << '\n';
    return 1;
  }
  return 0;
}
