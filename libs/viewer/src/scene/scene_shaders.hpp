#pragma once

namespace gelslam::viewer::detail {

// GLSL 3.30. Suffixes of names denote the frame: _m map, _s sensor, _c camera (x right, y up, z toward the
// viewer), _px pixels.
inline constexpr const char* kMeshVertexShader = R"(#version 330 core
layout(location = 0) in vec3 position_m;
layout(location = 1) in vec4 normal_m;
layout(location = 2) in vec2 curvature_confidence;
layout(location = 3) in float value;
uniform mat4 clip_T_map, camera_T_map;
uniform int color_by;  // SceneColor
out vec3 position_c, normal_c;
out float curvature, number, weight;
flat out float keyframe;
void main() {
  gl_Position = clip_T_map * vec4(position_m, 1.0);
  position_c = (camera_T_map * vec4(position_m, 1.0)).xyz;
  normal_c = mat3(camera_T_map) * normal_m.xyz;
  curvature = curvature_confidence.x;
  weight = curvature_confidence.y;
  keyframe = value;
  number = color_by == 1 ? curvature_confidence.y : color_by == 2 ? -position_m.z : value;
}
)";

inline constexpr const char* kMeshFragmentShader = R"(#version 330 core
in vec3 position_c, normal_c;
in float curvature, number, weight;
flat in float keyframe;
uniform int color_by, shading;  // SceneColor, SceneShading
uniform float range_min, range_max, curvature_gain, firm_weight, min_weight;
uniform sampler2D color_map, certainty;
uniform vec3 clay;  // linear
out vec4 color;

vec3 to_linear(vec3 c) { return pow(c, vec3(2.2)); }

vec3 tinted_clay() {
  float thin = 1.0 - smoothstep(0.3, 1.0, weight / firm_weight);
  ivec2 place = ivec2(int(keyframe) % 256, int(keyframe) / 256);
  float uncertainty = keyframe < 0.0 ? 0.0 : texelFetch(certainty, place, 0).r;
  return mix(mix(clay, vec3(0.20, 0.36, 0.62), 0.55 * thin), vec3(0.70, 0.34, 0.06), 0.6 * uncertainty);
}

vec3 surface_color() {
  if (color_by == 0) return clay;
  if (color_by == 4) return tinted_clay();
  if (number < -1e20) return vec3(0.30);
  float t = clamp((number - range_min) / max(range_max - range_min, 1e-12), 0.0, 1.0);
  return to_linear(texture(color_map, vec2((t * 255.0 + 0.5) / 256.0, 0.5)).rgb);
}

vec3 lit(vec3 albedo, vec3 n, vec3 v) {
  const vec3 key = normalize(vec3(-0.55, 0.62, 0.56)), fill = normalize(vec3(0.85, -0.15, 0.50));
  vec3 light = mix(vec3(0.10, 0.09, 0.085), vec3(0.27, 0.29, 0.33), 0.5 * n.y + 0.5);
  light += max(dot(n, key), 0.0) * vec3(0.95, 0.91, 0.84) + max(dot(n, fill), 0.0) * vec3(0.16, 0.19, 0.24);
  float shine = pow(max(dot(n, normalize(key + v)), 0.0), 32.0);
  return albedo * light * (1.0 + 0.28 * tanh(0.35 * curvature_gain * curvature)) + vec3(0.07) * shine;
}

vec3 by_curvature(vec3 albedo, vec3 n) {
  const vec3 grazing = normalize(vec3(-0.78, 0.48, 0.40));
  float light = 0.16 + 0.72 * max(dot(n, grazing), 0.0) + 0.26 * max(n.z, 0.0);
  return albedo * light * (1.0 + 0.62 * tanh(0.7 * curvature_gain * curvature));
}

void main() {
  if (weight < min_weight) discard;
  vec3 n = normalize(normal_c), v = normalize(-position_c), albedo = surface_color();
  // Coarse triangles may fold over; their normals still say which side it is.
  bool inside = !gl_FrontFacing && dot(n, v) < 0.0;
  if (inside) {
    n = -n;
    albedo = vec3(0.16, 0.17, 0.19);
  }
  vec3 c = inside || shading == 0 ? lit(albedo, n, v) : by_curvature(albedo, n);
  color = vec4(pow(c, vec3(1.0 / 2.2)), 1.0);
}
)";

inline constexpr const char* kTouchVertexShader = R"(#version 330 core
layout(location = 0) in vec3 position_s;
layout(location = 1) in vec3 normal_s;
layout(location = 2) in float inside_in;
uniform mat4 clip_T_camera, camera_T_sensor;
uniform float lift_mm;
out vec3 position_c, normal_c;
out float inside;
void main() {
  vec3 p = (camera_T_sensor * vec4(position_s, 1.0)).xyz;
  normal_c = mat3(camera_T_sensor) * normal_s;
  position_c = p * (1.0 - min(0.5, lift_mm / length(p)));  // toward the eye: nothing moves on the screen
  inside = inside_in;
  gl_Position = clip_T_camera * vec4(position_c, 1.0);
}
)";

inline constexpr const char* kTouchFragmentShader = R"(#version 330 core
in vec3 position_c, normal_c;
in float inside;
uniform float opacity;
uniform vec3 glow_rgb;  // linear
uniform int through;  // the object: from the inside, too
out vec4 color;
void main() {
  vec3 n = normalize(normal_c), v = normalize(-position_c);
  if (inside < 0.0 || (!gl_FrontFacing && through == 0)) discard;
  float key = max(dot(n, normalize(vec3(-0.55, 0.62, 0.56))), 0.0), facing = max(dot(n, v), 0.0);
  float rim = (1.0 - inside) * (1.0 - inside);
  vec3 glow = glow_rgb * (0.20 + 0.75 * key + 0.9 * rim + 0.35 * pow(1.0 - facing, 2.0));
  color = vec4(pow(min(glow, vec3(1.0)), vec3(1.0 / 2.2)), opacity * (0.55 + 0.40 * max(rim, 0.5 * key)));
}
)";

inline constexpr const char* kLineVertexShader = R"(#version 330 core
layout(location = 0) in vec3 from_m;
layout(location = 1) in vec3 to_m;
layout(location = 2) in vec4 rgba;
layout(location = 3) in float width;
uniform mat4 clip_T_map;
uniform vec2 viewport_px;
uniform float scale;
flat out vec4 line_color;
flat out float half_width_px, length_px;
out vec2 along_across_px;
void main() {
  vec4 a = clip_T_map * vec4(from_m, 1.0), b = clip_T_map * vec4(to_m, 1.0);
  float a_near = a.z + a.w, b_near = b.z + b.w;  // what lies before the near plane is cut off
  if (a_near < 0.0 && b_near > 0.0) a = mix(a, b, a_near / (a_near - b_near));
  if (b_near < 0.0 && a_near > 0.0) b = mix(b, a, b_near / (b_near - a_near));
  vec2 a_px = 0.5 * a.xy / a.w * viewport_px, b_px = 0.5 * b.xy / b.w * viewport_px;
  length_px = distance(a_px, b_px);
  vec2 x = length_px > 1e-4 ? (b_px - a_px) / length_px : vec2(1.0, 0.0), y = vec2(-x.y, x.x);
  half_width_px = 0.5 * width * scale;
  float reach = half_width_px + 1.0;
  bool at_end = gl_VertexID >= 2;
  float side = (gl_VertexID & 1) == 0 ? -1.0 : 1.0;
  along_across_px = vec2(at_end ? length_px + reach : -reach, side * reach);
  vec4 p = at_end ? b : a;
  vec2 moved_px = (at_end ? b_px + x * reach : a_px - x * reach) + y * side * reach;
  gl_Position = a_near < 0.0 && b_near < 0.0 ? vec4(2.0, 2.0, 2.0, 1.0)
                                             : vec4(moved_px / (0.5 * viewport_px) * p.w, p.z, p.w);
  line_color = rgba;
}
)";

inline constexpr const char* kLineFragmentShader = R"(#version 330 core
flat in vec4 line_color;
flat in float half_width_px, length_px;
in vec2 along_across_px;
uniform float opacity;
out vec4 color;
void main() {
  float beyond = max(max(-along_across_px.x, along_across_px.x - length_px), 0.0);
  float outside_px = length(vec2(beyond, along_across_px.y)) - half_width_px;
  float alpha = line_color.a * opacity * clamp(0.5 - outside_px, 0.0, 1.0);
  if (alpha < 0.004) discard;
  color = vec4(line_color.rgb, alpha);
}
)";

inline constexpr const char* kBackgroundVertexShader = R"(#version 330 core
out vec2 place;
void main() {
  place = vec2(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0);
  gl_Position = vec4(place, 1.0, 1.0);
}
)";

inline constexpr const char* kBackgroundFragmentShader = R"(#version 330 core
in vec2 place;
const vec3 top = vec3(0.175, 0.195, 0.225), bottom = vec3(0.070, 0.078, 0.092);
out vec4 color;
void main() {
  float glow = 0.10 * exp(-1.4 * dot(place, place));
  color = vec4(mix(bottom, top, smoothstep(-1.0, 1.0, place.y)) * (1.0 + glow), 1.0);
}
)";

}  // namespace gelslam::viewer::detail
