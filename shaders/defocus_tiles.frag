#version 330 core
// Per tile of the picture: the widest blur in front of the focus plane (x) and behind it (y), output px.
// DETOURS: see aperture.frag.
#include "samples.glsl"

uniform vec2 defocus_px_from_depth;  // see layers.glsl
uniform vec2 tile_uv;                // extent of a tile in texture coordinates
uniform int taps;                    // across a tile, per sample

in vec2 uv;
out vec2 width_px;

void main() {
    vec2 widest = vec2(0.0);
    for (int i = 0; i < sample_count; i++)
        for (int k = 0; k < taps * taps; k++) {
            vec2 within = (vec2(k % taps, k / taps) + 0.5) / float(taps) - 0.5;
            vec2 at = uv + within * tile_uv + samples[i].xy;
#ifdef DETOURS
            at = detoured(at, samples[i], detours[i]);
#endif
            float depth = textureLod(colors, vec3(at, samples[i].z), 0.0).a;
            float width = depth * defocus_px_from_depth.x + defocus_px_from_depth.y;
            widest = max(widest, vec2(width, -width));
        }
    width_px = widest;
}
