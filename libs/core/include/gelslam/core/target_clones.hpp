#pragma once

/// Whether functions can be compiled for instruction sets other than that of the program.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__)
#define GELSLAM_HAS_TARGETS 1
#else
#define GELSLAM_HAS_TARGETS 0
#endif

/// GELSLAM_TARGET("arch=x86-64-v3") before a function compiles it for this instruction set only.
#if GELSLAM_HAS_TARGETS
#define GELSLAM_TARGET(...) __attribute__((target(__VA_ARGS__)))
#else
#define GELSLAM_TARGET(...)
#endif

/// GELSLAM_TARGET_CLONES("avx2", "default") before a function compiles it once for each instruction set; the
/// version is chosen when the program is loaded. It must be a macro, because it expands to an attribute. It
/// is not used with sanitizers, because the version is chosen before their run time is ready, which crashes.
/// GELSLAM_CLONES is for AVX-512 and AVX2, both with fused multiply-add ("avx512f" alone has none for vectors
/// of 256 bits).
#if GELSLAM_HAS_TARGETS && !defined(__SANITIZE_ADDRESS__) && !defined(__SANITIZE_THREAD__)
#define GELSLAM_TARGET_CLONES(...) __attribute__((target_clones(__VA_ARGS__)))
#else
#define GELSLAM_TARGET_CLONES(...)
#endif

#define GELSLAM_CLONES GELSLAM_TARGET_CLONES("arch=x86-64-v4", "arch=x86-64-v3", "default")
