#version 330 core
// Light through the aperture: the mean over its views, sheared to the focus plane.
// LAYERS: keep light apart by defocus (layers.glsl). DETOURS: some views are missing and others stand in for them.
#include "samples.glsl"
#include "layers.glsl"

uniform float share;  // of this pass in the picture; the rest comes from the pinhole pass

in vec2 uv;

void main() {
    vec4 sum = vec4(0.0);
#ifdef LAYERS
    vec4 front = vec4(0.0), back = vec4(0.0);
#endif
    for (int i = 0; i < sample_count; i++) {
        vec4 wanted = samples[i];
        vec2 at = uv + wanted.xy;
#ifdef DETOURS
        at = detoured(at, wanted, detours[i]);
#endif
        vec4 light = linear_from_stored(textureLod(colors, vec3(at, wanted.z), 0.0));
        vec4 weighted = vec4(light.rgb, 1.0) * (wanted.w * in_picture(at));
        sum += weighted;
#ifdef LAYERS
        vec2 shares = layer_shares(light.a);
        front += shares.x * weighted;
        back += shares.y * weighted;
#endif
    }
    float scale = share / sum.a;
#ifdef LAYERS
    in_front = scale * front;
    behind = scale * back;
    sum -= front + back;
#endif
    in_focus = scale * sum;
}
