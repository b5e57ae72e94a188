#version 330 core
// An epipolar plane image: one line of the picture over the views of one row or column, each view a band.
#include "stored_view.glsl"

const int MAX_VIEWS = 128;

uniform int layers[MAX_VIEWS];  // of the views from the first band to the last; -1: not there yet
uniform int view_count;
uniform float line;             // texture coordinate of the line in the views
uniform vec2 span;              // what of it is shown: where it begins, and how much

in vec2 uv;
out vec4 color;

void main() {
#ifdef UPRIGHT
    float along = uv.y, across = uv.x;
#else
    float along = uv.x, across = uv.y;
#endif
    int layer = layers[clamp(int(across * float(view_count)), 0, view_count - 1)];
#ifdef UPRIGHT
    vec2 at = vec2(line, span.x + along * span.y);
#else
    vec2 at = vec2(span.x + along * span.y, line);
#endif
    vec3 root = textureLod(colors, vec3(at, float(max(layer, 0))), 0.0).rgb;
    color = vec4(layer < 0 ? missing() : shown(root), 1.0);
}
