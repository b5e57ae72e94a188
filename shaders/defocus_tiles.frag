#version 330 core
// Per tile of the picture: the widest blur in front of the focus plane (x) and behind it (y), in output px from one
// sample to the next.
// REPROJECT: see aperture.frag.
#include "part.glsl"
#include "samples.glsl"

uniform sampler2DArray blocks;  // least and greatest disparity of squares of the views
uniform float block_px;
uniform float blur_px;          // see layers.glsl
uniform vec2 tile_uv;           // extent of a tile in the target, texture coordinates
uniform int taps;               // across a tile, at least 2, so close that no block is left out

out vec4 width_px;

vec2 disparities_at(int i, vec2 place, float focus) {
    vec3 at = vec3(place - focus * samples[i].xy / view_size_px, samples[i].z);
#ifdef REPROJECT
    FallbackView fallback = fallback_view_of(i, place);
    at = vec3(reprojected_place(place, samples[i].xy, fallback, focus).xy, fallback.layer);
#endif
    ivec2 block = ivec2(at.xy * view_size_px / block_px);
    return texelFetch(blocks, ivec3(clamp(block, ivec2(0), textureSize(blocks, 0).xy - 1), at.z + 0.5), 0).rg;
}

void main() {
    vec2 tile = floor(gl_FragCoord.xy);
    vec2 widest = vec2(0.0);
    // Places of the tile, borders included, and for each what every sample sees there.
    for (int y = 0; y < taps; y++)
        for (int x = 0; x < taps; x++) {
            vec2 place = picture_uv((tile + vec2(x, y) / float(taps - 1)) * tile_uv);
            float focus = focus_at(place);
            for (int i = 0; i < sample_count; i++) {
                // Beside the focus by how much, less what the focus range leaves sharp.
                vec2 beside = disparities_at(i, place, focus) - focus;
                beside -= clamp(beside, -focus_range, focus_range);
                widest = max(widest, vec2(beside.y, -beside.x));
            }
        }
    width_px = vec4(blur_px * widest, 0.0, 0.0);
}
