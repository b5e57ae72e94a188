#version 330 core
// Spreads the defocused layers over what lies between neighbouring views: one direction of a box as wide as the blur.
uniform sampler2D front_layer, back_layer, tiles;
uniform vec2 px;  // the direction, one output pixel long, in texture coordinates

in vec2 uv;
layout(location = 0) out vec4 in_front;
layout(location = 1) out vec4 behind;

vec4 box_mean(sampler2D layer, float width_px) {
    int taps = clamp(int(ceil(0.5 * width_px)), 1, 48);  // two pixels apart: each tap averages two
    vec4 sum = vec4(0.0);
    for (int i = 0; i < taps; i++)
        sum += textureLod(layer, uv + px * width_px * ((float(i) + 0.5) / float(taps) - 0.5), 0.0);
    return sum / float(taps);
}

void main() {
    vec2 width_px = textureLod(tiles, uv, 0.0).xy;
    in_front = box_mean(front_layer, width_px.x);
    behind = box_mean(back_layer, width_px.y);
}
