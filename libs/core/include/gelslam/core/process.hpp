#pragma once

namespace gelslam {

/// Memory of this process that is in RAM now, in MB (2^20 bytes); 0 where the system does not tell.
double resident_memory_mb();

/// Lets every other thread of the machine go first: for work behind the tracker, which must never wait for a
/// core. Threads started by the calling thread afterwards inherit it. Does nothing where the system refuses.
void lower_thread_priority();

}  // namespace gelslam
