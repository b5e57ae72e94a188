#version 330 core
// The blocks of a target in which a slice has something within reach, six vertices each; the others are left out.
uniform usampler2D occupancy;  // of the surfaces, see occupancy.frag
uniform uint wanted[8];        // slices that count if they lie so many blocks away
uniform int reach;             // largest number of blocks
uniform ivec4 blocks;          // first block of the target (x, y), number of them across and down
uniform vec4 target_of_blocks; // target coordinates (-1..1): xy + zw * (x, y) of a corner, in blocks

flat out uint slices;

void main() {
    int index = gl_VertexID / 6, corner = gl_VertexID % 6;
    ivec2 block = ivec2(index % blocks.z, index / blocks.z) + blocks.xy, last = textureSize(occupancy, 0) - 1;
    slices = 0u;
    for (int y = -reach; y <= reach; y++) {
        for (int x = -reach; x <= reach; x++) {
            uint there = texelFetch(occupancy, clamp(block + ivec2(x, y), ivec2(0), last), 0).r;
            slices |= there & wanted[max(abs(x), abs(y))];
        }
    }
    ivec2 at = block + ivec2(corner == 1 || corner > 3 ? 1 : 0, corner > 1 && corner < 5 ? 1 : 0);
    vec2 place = target_of_blocks.xy + target_of_blocks.zw * vec2(at);
    gl_Position = vec4(slices == 0u ? vec2(2.0) : place, 0.0, 1.0);
}
