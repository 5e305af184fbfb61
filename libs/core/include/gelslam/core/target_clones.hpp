#pragma once

/// GELSLAM_TARGET_CLONES("avx2", "default") before a function: compiled once for each instruction set, chosen
/// when the program is loaded. A macro, because an attribute cannot be anything else. Not with sanitizers:
/// the choice is made before their run time is ready, and crashes.
#if defined(__x86_64__) && defined(__GNUC__) && !defined(__clang__) && !defined(__SANITIZE_ADDRESS__) && \
    !defined(__SANITIZE_THREAD__)
#define GELSLAM_TARGET_CLONES(...) __attribute__((target_clones(__VA_ARGS__)))
#else
#define GELSLAM_TARGET_CLONES(...)
#endif
