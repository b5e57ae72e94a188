#version 330 core
// The view from any point: stored views near the eye, each warped by its own disparity, front-most surface first.
// With one stored view (a photo and its disparity) this is the instant preview.
#include "front_most.glsl"
#include "layers.glsl"

const int MAX_SOURCES = 4;

uniform int source_count;
uniform vec4 sources[MAX_SOURCES];      // xy: texture coordinates per px of disparity, eye to view; z: layer; w: weight
uniform int search_steps[MAX_SOURCES];  // 0: this view has no disparity and counts as flat at the focus plane
uniform float share;                    // of this pass in the picture; the rest comes from the aperture pass

in vec2 uv;

Surface surface_in(int i) {
    if (search_steps[i] == 0) return Surface(focus_disparity, uv - focus_disparity * sources[i].xy, false);
    return front_most(uv, sources[i].z, sources[i].xy, search_steps[i]);
}

void main() {
    Surface surfaces[MAX_SOURCES];
    for (int i = 0; i < source_count; i++) surfaces[i] = surface_in(i);

    // A surface in front hides those behind it, the more the nearer its view is to the eye: nothing pops as it moves.
    float tolerance = 0.04 * (nearest - farthest) + 0.05;
    vec4 sum = vec4(0.0);
    float total = 0.0;
    for (int i = 0; i < source_count; i++) {
        float weight = sources[i].w;
        for (int j = 0; j < source_count; j++) {
            float in_front_by = surfaces[j].is_hidden ? 0.0 : surfaces[j].disparity - surfaces[i].disparity;
            float hides = clamp(in_front_by / tolerance - 1.0, 0.0, 1.0);
            weight *= 1.0 - hides * min(sources[j].w / sources[i].w, 1.0);
        }
        if (surfaces[i].is_hidden) weight *= 1e-3;
        weight *= in_picture(surfaces[i].at);
        weight = max(weight, 1e-8 * sources[i].w);
        vec4 light = linear_from_stored(textureLod(colors, vec3(surfaces[i].at, sources[i].z), 0.0));
        sum += weight * light;
        total += weight;
    }
    vec4 light = vec4(sum.rgb / total, 1.0) * share;
#ifdef LAYERS
    vec2 shares = layer_shares(sum.a / total);
    in_front = shares.x * light;
    behind = shares.y * light;
    light *= 1.0 - shares.x - shares.y;
#endif
    in_focus = light;
}
