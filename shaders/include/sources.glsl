// What a pinhole view is made of: stored views near the eye.
#include "field.glsl"

const int MAX_SOURCES = 4;

uniform int source_count;
uniform vec4 sources[MAX_SOURCES];      // xy: (s, t) from the eye to the view, view steps; z: layer; w: weight
uniform int search_steps[MAX_SOURCES];  // 0: this view has no disparity and counts as flat at the focus plane

// Texture coordinates per px of disparity, from the pixel's eye to the view.
vec2 delta_to(int i, vec2 uv) {
    return (sources[i].xy - dolly * (uv - 0.5)) / view_size_px;
}

// Surfaces that differ by less do not hide each other, px per view step.
float hiding_tolerance() {
    return 0.04 * (nearest - farthest) + 0.05;
}
