// Whatever the bytes, the reader says Error or gives a model: never a crash, a hang or another exception.

#include <gtest/gtest.h>

#include <array>
#include <functional>
#include <random>
#include <string>

#include "gelslam/core/error.hpp"
#include "gelslam/surface/model_file.hpp"
#include "pth_file.hpp"
#include "slopes/pickle_reader.hpp"

namespace gelslam::test {
namespace {

std::span<const unsigned char> as_bytes(const std::string& text) {
  return {reinterpret_cast<const unsigned char*>(text.data()), text.size()};
}

// One to four random damages: bit flip, byte, insertion, deletion, copy of a stretch, truncation.
std::string mutate(std::string bytes, std::mt19937_64& random) {
  const auto below = [&](std::size_t n) {
    return static_cast<std::size_t>(random() % std::max<std::size_t>(n, 1));
  };
  const std::size_t count = 1 + below(4);
  for (std::size_t i = 0; i < count && !bytes.empty(); ++i) {
    const std::size_t at = below(bytes.size());
    switch (below(6)) {
      case 0:
        bytes[at] = static_cast<char>(bytes[at] ^ (1 << below(8)));
        break;
      case 1:
        bytes[at] = static_cast<char>(random());
        break;
      case 2:
        bytes.insert(at, 1 + below(8), static_cast<char>(random()));
        break;
      case 3:
        bytes.erase(at, 1 + below(8));
        break;
      case 4:
        bytes.insert(below(bytes.size()), bytes.substr(at, 1 + below(40)));
        break;
      default:
        if (below(4) == 0) bytes.resize(at);
    }
  }
  return bytes;
}

struct Outcome {
  int accepted = 0, refused = 0;
};

Outcome attack(int attempts, std::uint64_t seed, const std::function<void(std::mt19937_64&)>& read_mutant) {
  Outcome outcome;
  std::mt19937_64 random(seed);
  for (int i = 0; i < attempts; ++i) {
    try {
      read_mutant(random);
      ++outcome.accepted;
    } catch (const Error&) {
      ++outcome.refused;
    }
  }
  return outcome;
}

PthFile original() {
  PthFile file;
  file.layers = random_layers(7);
  return file;
}

TEST(PthMutation, DamagedArchivesAreErrors) {
  const std::string whole = zip_archive(original().entries());
  const Outcome outcome = attack(4000, 11, [&](std::mt19937_64& random) {
    const std::string mutant = mutate(whole, random);
    parse_pth_model(as_bytes(mutant), "mutant");
  });
  EXPECT_GT(outcome.refused, 3000);  // the CRC catches nearly every damage
}

TEST(PthMutation, DamagedPicklesInSoundArchivesAreErrors) {
  const auto entries = original().entries();
  const Outcome outcome = attack(2000, 12, [&](std::mt19937_64& random) {
    auto mutant = entries;
    mutant["nnmodel/data.pkl"] = mutate(entries.at("nnmodel/data.pkl"), random);
    const std::string archive = zip_archive(mutant);
    parse_pth_model(as_bytes(archive), "mutant");
  });
  EXPECT_GT(outcome.refused, 1000);
  EXPECT_GT(outcome.accepted, 0);  // some bytes (device name, versions) do not matter
}

TEST(PthMutation, DamagedPicklesAreErrors) {
  PthFile checkpoint = original();
  checkpoint.checkpoint = true;
  PthFile newer = original();
  newer.protocol = 4;
  const std::array pickles = {original().pickle(), checkpoint.pickle(), newer.pickle()};
  const Outcome outcome = attack(30000, 13, [&](std::mt19937_64& random) {
    const std::string mutant = mutate(pickles[random() % pickles.size()], random);
    surface::detail::read_state_dict_pickle(mutant);
  });
  EXPECT_GT(outcome.refused, 15000);
}

}  // namespace
}  // namespace gelslam::test
