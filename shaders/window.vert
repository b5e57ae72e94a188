#version 330 core
// A picture as a rectangle in the room, the lower left corner first. Matrices are given as columns.
uniform vec4 to_eye[4], to_clip[4];
uniform vec2 size;  // m

out vec2 uv;

void main() {
    uv = vec2(gl_VertexID & 1, gl_VertexID >> 1);
    vec4 place = mat4(to_eye[0], to_eye[1], to_eye[2], to_eye[3]) * vec4((uv - 0.5) * size, 0.0, 1.0);
    gl_Position = mat4(to_clip[0], to_clip[1], to_clip[2], to_clip[3]) * place;
}
