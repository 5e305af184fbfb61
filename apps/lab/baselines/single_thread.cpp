#include "single_thread.hpp"

#include <omp.h>

namespace gelslam::baselines::detail {

// omp_set_num_threads() would not do: a num_threads clause overrules it.
SingleThread::SingleThread() : levels_before_(omp_get_max_active_levels()) { omp_set_max_active_levels(0); }

SingleThread::~SingleThread() { omp_set_max_active_levels(levels_before_); }

}  // namespace gelslam::baselines::detail
