// libFuzzer target for the model reader: first byte 0 takes the rest as a bare pickle (no CRC in the way),
// else as a whole .pth file. Only Error may come out. Built with -DGELSLAM_BUILD_FUZZERS=ON and clang; run it
// as
//   pth_fuzzer -max_len=20000 CORPUS_FOLDER

#include <cstddef>
#include <cstdint>
#include <span>
#include <string_view>

#include "gelslam/core/error.hpp"
#include "gelslam/surface/model_file.hpp"
#include "slopes/pickle_reader.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  if (size == 0) return 0;
  const std::span<const unsigned char> bytes(data + 1, size - 1);
  const std::string_view text(reinterpret_cast<const char*>(bytes.data()), bytes.size());
  try {
    if (data[0] == 0) {
      gelslam::surface::detail::read_state_dict_pickle(text);
    } else {
      gelslam::parse_pth_model(bytes, "fuzz");
    }
  } catch (const gelslam::Error&) {  // the only way to say no
  }
  return 0;
}
