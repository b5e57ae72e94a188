#version 330 core
// The slices whose light reaches a block of the picture, a bit for each.
const int MAX_REACH = 12;

uniform usampler2D occupancy;  // slices that have something in a block, see occupancy.frag
uniform uint wanted[MAX_REACH];        // slices that reach out of their block, over one block more, over two...
uniform int reach;             // largest number of blocks

out uint slices;

void main() {
    ivec2 block = ivec2(gl_FragCoord.xy), last = textureSize(occupancy, 0) - 1;
    slices = texelFetch(occupancy, block, 0).r;
    for (int y = -reach; y <= reach; y++) {
        for (int x = -reach; x <= reach; x++) {
            int between = int(length(max(abs(vec2(x, y)) - 1.0, 0.0)));
            uint there = texelFetch(occupancy, clamp(block + ivec2(x, y), ivec2(0), last), 0).r;
            slices |= there & (between < MAX_REACH ? wanted[between] : 0u);
        }
    }
}
