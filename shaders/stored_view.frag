#version 330 core
// One stored view, made smaller by averaging a few places of each pixel.
#include "stored_view.glsl"

uniform float layer;  // -1: not there yet
uniform int taps;     // each way
uniform vec2 pixel;   // texture coordinates from one pixel to the next

in vec2 uv;
out vec4 color;

void main() {
    vec3 light = vec3(0.0);
    for (int i = 0; i < taps * taps; i++) {
        vec2 place = (vec2(i % taps, i / taps) + 0.5) / float(taps) - 0.5;
        vec3 root = textureLod(colors, vec3(uv + place * pixel, max(layer, 0.0)), 0.0).rgb;
        light += root * root;
    }
    color = vec4(layer < 0.0 ? missing() : shown(sqrt(light / float(taps * taps))), 1.0);
}
