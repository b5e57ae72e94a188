#version 330 core
// Per tile of the picture and per source: the first and the last step of the search for the front-most surface that can
// tell anything. Before it there is only empty space, behind it only the inside of things; see first_hit.glsl. Where
// no source sees an edge: about the disparity of the surface, and -1.
#include "part.glsl"
#include "sources.glsl"

uniform sampler2DArray blocks;  // least and greatest disparity of squares of the views
uniform float block_px;
uniform vec2 tile_uv;           // extent of a tile in the target, texture coordinates
uniform vec2 pixel_uv;          // of a pixel: surfaces are looked for beside its middle too

const int CHUNKS = 16;          // so many parts of the search are distinguished
const float SEAM_PX = 3.0;      // farther than edges are looked for beside a surface

layout(location = 0) out vec4 intervals_of_0_and_1;
layout(location = 1) out vec4 intervals_of_2_and_3;

// Least and greatest disparity of all that the tile's pixels may meet from one disparity to another.
vec2 seen_between(int i, float from, float to) {
    vec2 tile = floor(gl_FragCoord.xy), low = vec2(1e9), high = vec2(-1e9);
    // Where the tile's rays lie in the view between both disparities: the extremes are at its corners and at both ends.
    for (int corner = 0; corner < 4; corner++) {
        vec2 uv = picture_uv((tile + vec2(corner & 1, corner >> 1)) * tile_uv), delta = delta_to(i, uv);
        low = min(low, uv - max(delta * from, delta * to));
        high = max(high, uv - min(delta * from, delta * to));
    }
    vec2 margin = pixel_uv * view_size_px + SEAM_PX;
    ivec2 last_block = textureSize(blocks, 0).xy - 1;
    ivec2 first = clamp(ivec2(floor((low * view_size_px - margin) / block_px)), ivec2(0), last_block);
    ivec2 last = clamp(ivec2(floor((high * view_size_px + margin) / block_px)), ivec2(0), last_block);
    // The range of all blocks there, by their least and greatest disparity.
    vec2 seen = vec2(1e9, -1e9);
    for (int y = first.y; y <= last.y; y++)
        for (int x = first.x; x <= last.x; x++) {
            vec2 block = texelFetch(blocks, ivec3(x, y, int(sources[i].z + 0.5)), 0).rg;
            seen = vec2(min(seen.x, block.x), max(seen.y, block.y));
        }
    return seen;
}

ivec2 interval_of(int i, float stride) {
    int steps = search_steps[i], chunk = (steps + CHUNKS) / CHUNKS;  // steps 0..steps, both included
    int first = 0, last = steps;
    // From the front: skip chunks whose steps are all nearer than any surface there; see first_hit for the bounds.
    for (; first <= steps; first += chunk) {
        float from = nearest - stride * float(first), to = from - stride * float(chunk - 1);
        if (seen_between(i, from, to).y >= to - 0.5 * stride) break;
    }
    // From behind: skip chunks whose steps all lie behind the surfaces there.
    for (; last > first; last -= chunk) {
        float to = nearest - stride * float(last), from = to + stride * float(chunk - 1);
        if (seen_between(i, from, to).x <= from + 1.5 * stride) break;
    }
    // From the step before, which is in empty space.
    return ivec2(max(first - 1, 0), min(max(last, first), steps));
}

void main() {
    ivec2 spans[MAX_SOURCES];
    vec2 seen[MAX_SOURCES];
    bool is_flat = true;
    for (int i = 0; i < source_count; i++) {
        float stride = (nearest - farthest) / float(max(search_steps[i], 1));
        spans[i] = interval_of(i, stride);
        seen[i] = seen_between(i, nearest - stride * float(spans[i].x), nearest - stride * float(spans[i].y));
        // One surface without edges, as far as the march could tell.
        is_flat = is_flat && search_steps[i] > 0 && seen[i].y - seen[i].x < 1.5 * stride;
    }
    // Flat only if it is so in all sources; unused slots repeat the last one.
    vec2 found[MAX_SOURCES];
    for (int i = 0; i < MAX_SOURCES; i++) {
        int k = min(i, source_count - 1);
        found[i] = is_flat ? vec2(0.5 * (seen[k].x + seen[k].y), -1.0) : vec2(spans[k]);
    }
    intervals_of_0_and_1 = vec4(found[0], found[1]);
    intervals_of_2_and_3 = vec4(found[2], found[3]);
}
