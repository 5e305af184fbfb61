#pragma once

namespace gelslam::simulation::detail {

/// Samples that are worked on together. Buffers are [neuron][sample], samples contiguous.
inline constexpr int tile_samples = 128;

/// out[o] = bias[o] + sum_i weight[o * inputs + i] * in[i]; bias may be null.
void affine(const float* weight, const float* bias, const float* in, float* out, int outputs, int inputs);

/// gradient[o * inputs + i] += sum over samples of delta[o] * in[i].
void add_weight_gradient(const float* delta, const float* in, float* gradient, int outputs, int inputs);

/// Negative values to 0.
void relu(float* values, int neurons);

/// delta to 0 where the layer's output is 0.
void relu_backward(const float* output, float* delta, int neurons);

/// One step of Adam (Kingma & Ba 2015, algorithm 1); `rate` includes the bias corrections.
void adam(float* weight, const float* gradient, float* first, float* second, int count, float rate,
          float epsilon);

}  // namespace gelslam::simulation::detail
