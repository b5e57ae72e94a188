#version 330 core
// The widest blur among a tile and its neighbours: light spreads over tile borders.
uniform sampler2D tiles;
uniform int reach;  // tiles

out vec4 width_px;

void main() {
    ivec2 here = ivec2(gl_FragCoord.xy), last = textureSize(tiles, 0) - 1;
    vec2 widest = vec2(0.0);
    for (int y = -reach; y <= reach; y++)
        for (int x = -reach; x <= reach; x++)
            widest = max(widest, texelFetch(tiles, clamp(here + ivec2(x, y), ivec2(0), last), 0).xy);
    width_px = vec4(widest, 0.0, 0.0);
}
