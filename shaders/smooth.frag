#version 330 core
// Spreads the defocused layers over what lies between neighbouring samples: one direction of a box as wide as the blur,
// at half the picture's size: so wide a blur needs no more. What half the size itself blurs too much, see present.frag.
#include "smoothing.glsl"

uniform sampler2D foreground_layer, background_layer;
uniform vec2 texel_step;      // texture coordinates from one texel of the target to the next, in this direction
uniform float empty_up_to_px; // as wide a blur is in the sharp layer

in vec2 uv;
layout(location = 0) out vec4 in_front;
layout(location = 1) out vec4 behind;

vec4 box_mean(sampler2D layer, float width_px) {
    if (width_px <= empty_up_to_px) return vec4(0.0);
    // Variances add: what the half size blurs already is taken off. reach: half the box, texels of two px.
    float reach = 0.25 * sqrt(max(width_px * width_px - HALF_SIZE_BLUR, 4.0));
    int whole = int(min(ceil(reach - 0.5), 40.0));
    vec4 sum = vec4(0.0);
    // A box with antialiased ends; in the middle of four pixels a fetch is their mean.
    for (int i = -whole; i <= whole; i++)
        sum += clamp(reach + 0.5 - abs(float(i)), 0.0, 1.0) * textureLod(layer, uv + float(i) * texel_step, 0.0);
    return sum / (2.0 * reach);
}

void main() {
    vec2 width_px = blur_width_px(uv);
    in_front = box_mean(foreground_layer, width_px.x);
    behind = box_mean(background_layer, width_px.y);
}
