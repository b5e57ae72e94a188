#version 330 core
// Linear light to the screen: layers put together, exposure, sRGB, and the flip from row 0 first to GL's bottom up.
// LINEAR: without sRGB, and not cut off at white or 0.
#include "srgb.glsl"
#include "primaries.glsl"

uniform sampler2D focus_layer;
#ifdef LAYERS
#include "smoothing.glsl"
uniform sampler2D foreground_layer, background_layer, smooth_foreground, smooth_background;
#endif
uniform float exposure;  // factor

in vec2 uv;
out vec4 color;

#ifdef LAYERS
// In-focus and smoothed background share what the smoothed foreground leaves free; where either is unknown (deep inside
// the foreground) the foreground's own colour stands in.
vec3 composed(vec2 at, ivec2 here) {
    vec4 focus = texelFetch(focus_layer, here, 0);
    vec4 foreground = texelFetch(foreground_layer, here, 0), background = texelFetch(background_layer, here, 0);
    float back_weight = background.a, total = max(focus.a + foreground.a + back_weight, 1e-9);
    // Less is smoothed than half the size blurs: a mean of both is as wide as asked for.
    vec2 smoothed = min(blur_width_px(at) * blur_width_px(at) / HALF_SIZE_BLUR, 1.0);
    foreground = mix(foreground, textureLod(smooth_foreground, at, 0.0), smoothed.x);
    background = mix(background, textureLod(smooth_background, at, 0.0), smoothed.y);
    // The smoothed background gets the weight that it had before smoothing.
    float back_scale = back_weight / max(background.a, 1e-4 * total);
    // Over both lies the smoothed foreground (alpha compositing).
    vec4 beyond = focus + back_scale * background + 1e-3 * foreground;
    return mix(beyond.rgb / max(beyond.a, 1e-9), foreground.rgb / max(foreground.a, 1e-9), min(foreground.a / total, 1.0));
}
#endif

void main() {
    vec2 at = vec2(uv.x, 1.0 - uv.y);
    ivec2 here = ivec2(at * vec2(textureSize(focus_layer, 0)));
#ifdef LAYERS
    vec3 light = composed(at, here);
#else
    vec4 sum = texelFetch(focus_layer, here, 0);
    vec3 light = sum.rgb / max(sum.a, 1e-12);
#endif
    light = in_target(light * exposure);
#ifndef LINEAR
    light = srgb_from_linear(clamp(light, 0.0, 1.0));
#endif
    color = vec4(light, 1.0);
}
