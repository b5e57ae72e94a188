#version 330 core
// One triangle over the whole target. uv (0, 0) is the corner of row 0: every target but the screen keeps row 0 first.
out vec2 uv;

void main() {
    uv = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    gl_Position = vec4(uv * 2.0 - 1.0, 0.0, 1.0);
}
