#pragma once

namespace gelslam {

/// Memory of this process that is in RAM now, in MB (2^20 bytes); 0 where the system does not tell.
double resident_memory_mb();

/// Lowers the calling thread's priority by ten nice steps below what it has (so that a program started under
/// `nice` keeps the order among its own threads): for work that must never keep the tracker waiting. Threads
/// it starts afterwards inherit it; call it once per thread. Does nothing where the system refuses.
void lower_thread_priority();

}  // namespace gelslam
