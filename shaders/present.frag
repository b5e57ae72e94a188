#version 330 core
// Linear light to the screen: layers put together, exposure, sRGB, and the flip from row 0 first to GL's bottom up.
uniform sampler2D focus_layer;
#ifdef LAYERS
uniform sampler2D back_layer, smooth_front, smooth_back;
#endif
uniform float exposure;  // factor

in vec2 uv;
out vec4 color;

#ifdef LAYERS
// In-focus and smoothed background share what the smoothed foreground leaves free; where either is unknown (deep inside
// the foreground) the foreground's own colour stands in.
vec3 composed(vec2 at) {
    vec4 front = textureLod(smooth_front, at, 0.0), back = textureLod(smooth_back, at, 0.0);
    vec4 focus = textureLod(focus_layer, at, 0.0);
    float back_share = textureLod(back_layer, at, 0.0).a;
    float unknown = 1e-3 * front.a;
    vec3 beyond = focus.rgb + back_share * back.rgb / max(back.a, 1e-4) + 1e-3 * front.rgb;
    beyond /= max(focus.a + back_share + unknown, 1e-6);
    return front.rgb + max(1.0 - front.a, 0.0) * beyond;
}
#endif

// IEC 61966-2-1
vec3 srgb_from_linear(vec3 light) {
    return mix(1.055 * pow(light, vec3(1.0 / 2.4)) - 0.055, 12.92 * light, vec3(lessThanEqual(light, vec3(0.0031308))));
}

void main() {
    vec2 at = vec2(uv.x, 1.0 - uv.y);
#ifdef LAYERS
    vec3 light = composed(at);
#else
    vec3 light = textureLod(focus_layer, at, 0.0).rgb;
#endif
    color = vec4(srgb_from_linear(clamp(light * exposure, 0.0, 1.0)), 1.0);
}
