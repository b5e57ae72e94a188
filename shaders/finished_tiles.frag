#version 330 core
// To be multiplied with what is summed up: a tile that has all its passes counts as if it had got one more, so that all
// tiles weigh alike.
layout(location = 0) out vec4 in_focus;
layout(location = 1) out vec4 in_front;
layout(location = 2) out vec4 behind;

uniform sampler2D tiles;  // see widen_tiles.frag
uniform float passes;     // of the picture that are drawn

in vec2 target_uv;

void main() {
    float wanted = texelFetch(tiles, ivec2(target_uv * vec2(textureSize(tiles, 0))), 0).z;
    in_focus = in_front = behind = vec4(passes > wanted ? passes / (passes - 1.0) : 1.0);
}
