#version 330 core
// To be multiplied with what is summed up: a tile that has all its passes counts as if it had got one more, so that all
// tiles weigh alike.
#include "smoothing.glsl"

in vec2 target_uv;
layout(location = 0) out vec4 in_focus;
layout(location = 1) out vec4 in_front;
layout(location = 2) out vec4 behind;

void main() {
    in_focus = in_front = behind = vec4(passes > passes_wanted(target_uv) ? passes / (passes - 1.0) : 1.0);
}
