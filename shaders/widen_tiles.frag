#version 330 core
// The widest blur among a tile and its neighbours (xy), for light spreads over tile borders, and in how many passes the
// tile is drawn (z): in as many as its samples need to lie close.
uniform sampler2D tiles;
uniform int reach;  // tiles
uniform float one_pass_up_to_px, pass_blur_px;  // blur from one sample to the next: see picture_lens.py
uniform float least_passes;                     // where it is more than one

out vec4 width_px;

void main() {
    ivec2 here = ivec2(gl_FragCoord.xy), last = textureSize(tiles, 0) - 1;
    vec2 widest = vec2(0.0);
    for (int y = -reach; y <= reach; y++)
        for (int x = -reach; x <= reach; x++)
            widest = max(widest, texelFetch(tiles, clamp(here + ivec2(x, y), ivec2(0), last), 0).xy);
    float between_px = max(widest.x, widest.y), times = between_px / pass_blur_px;
    float passes = between_px > one_pass_up_to_px ? max(ceil(times * times), least_passes) : 1.0;
    width_px = vec4(widest, passes, 0.0);
}
