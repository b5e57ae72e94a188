#version 330 core
// An epipolar plane image: one line of the picture over the views of one row or column, each view a band.
#include "stored_view.glsl"
#ifdef GLOSS
uniform vec2 view_size_px, view_step;
uniform float nearest, farthest;  // range of disparities, px per view step
#endif
#include "gloss.glsl"

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
    int index = clamp(int(across * float(view_count)), 0, view_count - 1);
    int layer = layers[index];
#ifdef UPRIGHT
    vec2 at = vec2(line, span.x + along * span.y);
#else
    vec2 at = vec2(span.x + along * span.y, line);
#endif
    vec4 stored = textureLod(colors, vec3(at, float(max(layer, 0))), 0.0);
#ifdef GLOSS
#ifdef UPRIGHT
    vec2 view = eye + vec2(0.0, float(index));
#else
    vec2 view = eye + vec2(float(index), 0.0);
#endif
    stored.rgb = sqrt(glossy(stored.rgb * stored.rgb, at, view, stored.a, view));
#endif
    color = vec4(layer < 0 ? missing() : shown(stored.rgb), 1.0);
}
