#version 330 core
// One triangle over the whole target. uv (0, 0) is the corner of row 0: every target but the screen keeps row 0 first.
out vec2 uv;

// Of the four pixels that one of half the size covers, the first stands for all: in their middle, at a texel's corner,
// surfaces would mix. Passes of half the size look there.
uniform vec2 nudge;

void main() {
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    uv = corner + nudge;
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}
