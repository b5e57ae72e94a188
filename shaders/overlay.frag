#version 330 core
// A number at every pixel of one stored view, as colours over the picture seen from the eye.
#include "first_hit.glsl"

const int STOPS = 10;

uniform vec2 to_view;          // (s, t) from the eye to the view, view steps
uniform float layer;
uniform vec3 color_map[STOPS]; // sRGB, evenly spaced
uniform vec2 map_ends;         // the values at its first and last colour
uniform float opacity;
#ifdef VALUES
uniform sampler2D values;      // of the view; row 0 first
#endif

in vec2 uv;
out vec4 color;

vec3 mapped(float value) {
    float place = clamp((value - map_ends.x) / (map_ends.y - map_ends.x), 0.0, 1.0) * float(STOPS - 1);
    int first = min(int(place), STOPS - 2);
    return mix(color_map[first], color_map[first + 1], place - float(first));
}

void main() {
    vec2 from_ray = (to_view - dolly * (uv - 0.5)) * view_step / view_size_px;
    Surface found = first_hit(Ray(uv, vec2(0.0), from_ray, layer, 0.0));
#ifdef VALUES
    float value = textureLod(values, found.at, 0.0).r;
#else
    float value = found.disparity;
#endif
    color = vec4(mapped(value), opacity);
#ifdef MASK
    color.a *= step(0.5, value);
#endif
}
