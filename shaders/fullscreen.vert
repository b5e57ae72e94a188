#version 330 core
// One triangle over the whole target. Texture coordinates (0, 0) are the corner of row 0: every target but the screen
// keeps row 0 first. uv: in the picture; target_uv: in the target, which may hold a part of it.
// FLAT, EDGES: a square for each tile of one kind only, see march_intervals.frag. A branch in the fragment shader would
// not do: software GL follows both ways.
#include "part.glsl"

out vec2 uv, target_uv;

#if defined(FLAT) || defined(EDGES)
uniform sampler2D intervals_of_0_and_1;
flat out ivec2 tile;

void main() {
    ivec2 tiles = textureSize(intervals_of_0_and_1, 0);
    int number = gl_VertexID / 6, corner = gl_VertexID % 6;
    tile = ivec2(number % tiles.x, number / tiles.x);
    bool is_flat = texelFetch(intervals_of_0_and_1, tile, 0).y < 0.0;
    vec2 at = vec2(tile) + vec2(corner == 1 || corner > 3, corner == 2 || corner == 3 || corner == 5);
    target_uv = at / vec2(tiles);
    uv = picture_uv(target_uv);
    gl_Position = vec4(at / vec2(tiles) * 2.0 - 1.0, 0.0, 1.0);
#ifdef FLAT
    if (!is_flat) gl_Position.x = 2.0;  // no area
#else
    if (is_flat) gl_Position.x = 2.0;
#endif
}
#else
void main() {
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    target_uv = corner;
    uv = picture_uv(target_uv);
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}
#endif
