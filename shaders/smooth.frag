#version 330 core
// Spreads the defocused layers over what lies between neighbouring samples: one direction of a box as wide as the blur.
uniform sampler2D front_layer, back_layer, tiles;
uniform ivec2 direction;
uniform float narrowing;      // what remains of the blur that the tiles tell: more passes leave less in between
uniform float empty_up_to_px; // as wide a blur is in the sharp layer

const float HALF_SIZE_BLUR = 8.0;  // px squared: half the size is a blur too, as wide as a box of this width squared

in vec2 uv;
layout(location = 0) out vec4 in_front;
layout(location = 1) out vec4 behind;

vec4 box_mean(sampler2D layer, float width_px) {
    if (width_px <= empty_up_to_px) return vec4(0.0);
    ivec2 here = ivec2(gl_FragCoord.xy), last = textureSize(layer, 0) - 1;
    width_px *= narrowing;
    // Variances add: what the half size blurs already is taken off. reach: half the box, texels.
    float reach = 0.25 * sqrt(max(width_px * width_px - HALF_SIZE_BLUR, 4.0));  // a texel is two px wide
    int whole = int(min(ceil(reach - 0.5), 40.0));
    vec4 sum = vec4(0.0);
    // A box with antialiased ends.
    for (int i = -whole; i <= whole; i++)
        sum += clamp(reach + 0.5 - abs(float(i)), 0.0, 1.0)
            * texelFetch(layer, clamp(here + i * direction, ivec2(0), last), 0);
    return sum / (2.0 * reach);
}

void main() {
    vec2 width_px = textureLod(tiles, uv, 0.0).xy;
    in_front = box_mean(front_layer, width_px.x);
    behind = box_mean(back_layer, width_px.y);
}
