#version 330 core
// A picture's corners in the clip space of an eye, the lower left one first.
uniform vec4 corners[4];

out vec2 uv;

void main() {
    uv = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    gl_Position = corners[gl_VertexID];
}
