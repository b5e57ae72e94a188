#version 330 core
// The blocks of a target in which some slices have something, a square point for one or some; the others are left out.
uniform usampler2D occupancy;  // slices of each block of the surfaces
uniform uint wanted;           // slices that count
uniform ivec4 points;          // first point of the viewport (x, y), number of them across and down
uniform int point_blocks;      // side of a point in blocks, and in px of the target
uniform float point_px;

flat out uint slices;

void main() {
    ivec2 at = ivec2(gl_VertexID % points.z, gl_VertexID / points.z), last = textureSize(occupancy, 0) - 1;
    slices = 0u;
    for (int i = 0; i < point_blocks * point_blocks; i++) {
        ivec2 block = point_blocks * (points.xy + at) + ivec2(i % point_blocks, i / point_blocks);
        slices |= texelFetch(occupancy, clamp(block, ivec2(0), last), 0).r;
    }
    slices &= wanted;
    vec2 place = 2.0 * (vec2(at) + 0.5) / vec2(points.zw) - 1.0;
    gl_Position = vec4(slices == 0u ? vec2(2.0) : place, 0.0, 1.0);
    gl_PointSize = point_px;
}
