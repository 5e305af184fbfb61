#include "gelslam/core/npy.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <limits>

#include "../support/temporary_folder.hpp"

namespace gelslam::test {
namespace {

/// numpy.save("f.npy", numpy.array([[1.5, -2.0, 3.25]])) as numpy 1.24 wrote it.
std::string numpy_sample() {
  std::string header = "{'descr': '<f8', 'fortran_order': False, 'shape': (1, 3), }";
  header.append(117 - header.size(), ' ');
  std::string bytes = std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header + "\n";
  for (const double value : {1.5, -2.0, 3.25})
    bytes.append(reinterpret_cast<const char*>(&value), sizeof value);
  return bytes;
}

std::string with_header(const std::string& header, const std::string& data, char version = 1) {
  std::string bytes("\x93NUMPY", 6);
  bytes += {version, '\0', static_cast<char>(header.size() & 0xff), static_cast<char>(header.size() >> 8)};
  if (version > 1) bytes += std::string(2, '\0');
  return bytes + header + data;
}

std::string error_for(const std::string& bytes, std::size_t max_bytes = 1u << 20) {
  TemporaryFolder folder;
  write_bytes(folder / "a.npy", bytes);
  return message_of([&] { read_npy(folder / "a.npy", max_bytes); });
}

TEST(Npy, ReadsAndWritesNumpysOwnBytes) {
  TemporaryFolder folder;
  write_bytes(folder / "a.npy", numpy_sample());
  const NpyArray array = read_npy(folder / "a.npy");
  EXPECT_EQ(array.type, NpyType::float64);
  EXPECT_THAT(array.shape, ElementsAre(1u, 3u));
  EXPECT_THAT(array.to_doubles(), ElementsAre(1.5, -2.0, 3.25));
  write_npy(folder / "b.npy", array.shape, std::span<const double>(array.to_doubles()));
  EXPECT_EQ(read_bytes(folder / "b.npy"), numpy_sample());
}

TEST(Npy, EveryTypeComesBack) {
  TemporaryFolder folder;
  const auto path = folder / "a.npy";
  const float nan = std::numeric_limits<float>::quiet_NaN();
  write_npy(path, {2}, std::span<const float>(std::vector<float>{0.1f, nan}));
  EXPECT_THAT(read_npy(path).to_doubles(), ElementsAre(static_cast<double>(0.1f), testing::IsNan()));
  struct Kind {
    std::string type, shape, bytes;
    std::vector<double> values;
  };
  const double infinity = std::numeric_limits<double>::infinity();
  for (const Kind& kind :
       {Kind{"<i8",
             "(2, 1)",
             std::string(8, '\xff') + std::string("\0\0\0\0\0\1\0\0", 8),
             {-1, 1099511627776}},
        Kind{"|u1", "(2,)", std::string("\0\xff", 2), {0, 255}},
        Kind{"|b1", "(1, 1, 2)", std::string("\1\0", 2), {1, 0}},
        // What numpy writes for np.float16([0, 1, -2, 65504, 2**-24, 0.1, np.inf, np.nan]).
        Kind{"<f2",
             "(8,)",
             std::string("\x00\x00\x00\x3c\x00\xc0\xff\x7b\x01\x00\x66\x2e\x00\x7c\x00\x7e", 16),
             {0, 1, -2, 65504, std::ldexp(1.0, -24), 0.0999755859375, infinity, std::nan("")}}}) {
    write_bytes(path, with_header("{'descr': '" + kind.type +
                                      "', 'fortran_order': False, 'shape': " + kind.shape + ", }\n",
                                  kind.bytes));
    EXPECT_THAT(read_npy(path).to_doubles(), testing::Pointwise(testing::NanSensitiveDoubleEq(), kind.values))
        << kind.type;
    EXPECT_EQ(read_npy(path).type == NpyType::boolean, kind.type == "|b1");
  }
}

TEST(Npy, WritingRefusesWhatDoesNotFit) {
  const std::vector<double> three{1, 2, 3};
  EXPECT_THROW(write_npy("unused.npy", {2}, std::span<const double>(three)), std::invalid_argument);
  EXPECT_THROW(write_npy("unused.npy", {4}, std::span<const double>(three)), std::invalid_argument);
  EXPECT_THROW(write_npy("unused.npy", {std::size_t{1} << 62, 4}, std::span<const double>()),
               std::invalid_argument);
}

TEST(Npy, WhatIsLongerOrElsewhereIsSaid) {
  EXPECT_THAT(error_for(numpy_sample() + "x"), HasSubstr("longer than its header says"));
  EXPECT_THAT(error_for(std::string(kLfsPointer)), HasSubstr(kLfsAdvice));
}

TEST(Npy, ForeignArraysAreRefusedWithTheReason) {
  const std::string data(48, '\0');
  const auto entry = [](const std::string& descr, const std::string& order, const std::string& shape) {
    return "{'descr': " + descr + ", 'fortran_order': " + order + ", 'shape': " + shape + ", }\n";
  };
  EXPECT_THAT(error_for(with_header(entry("'<f8'", "True", "(2, 3)"), data)), HasSubstr("Fortran order"));
  EXPECT_THAT(error_for(with_header(entry("'>f8'", "False", "(2, 3)"), data)), HasSubstr("element type >f8"));
  EXPECT_THAT(error_for(with_header(entry("'|O'", "False", "(2, 3)"), data)), HasSubstr("element type |O"));
  EXPECT_THAT(error_for(with_header(entry("[('a', '<f8')]", "False", "(6,)"), data)),
              HasSubstr("not a usable"));
  EXPECT_THAT(error_for(with_header(entry("'<f8'", "False", "(2, 3)"), data, 4)), HasSubstr("version"));
  EXPECT_EQ(error_for(with_header(entry("'<f8'", "False", "(2, 3)"), data, 2)), "nothing was thrown");
  EXPECT_EQ(error_for(with_header("{\"shape\":(6L,),\"fortran_order\":True,\"descr\":\"<f8\"}", data)),
            "nothing was thrown");
}

TEST(Npy, HostileHeadersAreErrors) {
  const std::string data(8, '\0');
  for (const char* shape : {"(99999999999999999999999,)", "(4294967296, 4294967296, 4294967296)",
                            "(18446744073709551615,)", "(-1,)", "(1", "1", "(1,,)", "(a,)", "(1.5,)",
                            "(1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1,1)"}) {
    const std::string header =
        std::string("{'descr': '<f8', 'fortran_order': False, 'shape': ") + shape + "}";
    EXPECT_THAT(error_for(with_header(header, data)), HasSubstr("not a usable .npy file")) << shape;
  }
  for (const char* header : {"", "{", "{}", "{'descr'", "{'descr': '<f8}", "{'x': 1}", "import os",
                             "{'descr': '<f8', 'descr': '<f8', 'fortran_order': False, 'shape': (1,)}",
                             "{'descr': '<f8', 'fortran_order': 0, 'shape': (1,)}",
                             "{'descr': '<f8', 'fortran_order': False, 'shape': (1,)} x",
                             "{'descr': '<f8', 'fortran_order': False, 'shape': (1,)}, {}",
                             "{'descr': '<f4\n\r\n', 'fortran_order': False, 'shape': (1,)}"}) {
    const std::string error = error_for(with_header(header, data));
    EXPECT_THAT(error, HasSubstr("not a usable .npy file")) << header;
    EXPECT_EQ(error.find_first_of("\n\r"), std::string::npos) << error;
  }
  EXPECT_THAT(error_for(numpy_sample(), 16), HasSubstr("claims more than 16 bytes"));
  EXPECT_THAT(message_of([] { read_npy("/nonexistent.npy"); }), HasSubstr("no such file"));
  EXPECT_THAT(message_of([] { read_npy("/tmp"); }), HasSubstr("no such file"));
}

}  // namespace
}  // namespace gelslam::test
