#version 330 core
// A picture in a headset, with a dot where each hand points.
#include "srgb.glsl"

uniform sampler2D light_sum;  // weighted by alpha, row 0 first
uniform vec4 pointed;         // two places of the window, from its lower left corner
uniform vec2 size;            // of the window, m

in vec2 uv;
out vec4 color;

vec3 light_of(ivec2 texel) {
    vec4 sum = texelFetch(light_sum, clamp(texel, ivec2(0), textureSize(light_sum, 0) - 1), 0);
    return clamp(sum.rgb / max(sum.a, 1e-12), 0.0, 1.0);
}

void main() {
    vec2 at = vec2(uv.x, 1.0 - uv.y) * vec2(textureSize(light_sum, 0)) - 0.5, f = fract(at);
    ivec2 first = ivec2(floor(at));
    vec3 above = mix(light_of(first), light_of(first + ivec2(1, 0)), f.x);
    vec3 below = mix(light_of(first + ivec2(0, 1)), light_of(first + 1), f.x);
    float away = min(length((uv - pointed.xy) * size), length((uv - pointed.zw) * size));
    color = vec4(mix(srgb_from_linear(mix(above, below, f.y)), vec3(1.0), smoothstep(0.012, 0.008, away)), 1.0);
}
