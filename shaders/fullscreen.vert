#version 330 core
// One triangle over the whole target. Texture coordinates (0, 0) are the corner of row 0: every target but the screen
// keeps row 0 first.
uniform vec4 part;  // of the picture that the target holds: left, top, width, height

out vec2 uv;  // in the picture

void main() {
    vec2 corner = vec2((gl_VertexID << 1) & 2, gl_VertexID & 2);
    uv = part.xy + corner * part.zw;
    gl_Position = vec4(corner * 2.0 - 1.0, 0.0, 1.0);
}
