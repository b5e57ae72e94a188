#version 330 core
// Linear light to the screen: exposure, sRGB, and the flip from row 0 first to GL's bottom up.
// LINEAR: without sRGB, and not cut off at white or 0.
#include "srgb.glsl"
#include "primaries.glsl"

uniform sampler2D light_sum;  // weighted by alpha
uniform float exposure;       // factor

in vec2 uv;
out vec4 color;

void main() {
    vec2 at = vec2(uv.x, 1.0 - uv.y);
    vec4 sum = texelFetch(light_sum, ivec2(at * vec2(textureSize(light_sum, 0))), 0);
    vec3 light = in_target(sum.rgb / max(sum.a, 1e-12) * exposure);
#ifndef LINEAR
    light = srgb_from_linear(clamp(light, 0.0, 1.0));
#endif
    color = vec4(light, 1.0);
}
