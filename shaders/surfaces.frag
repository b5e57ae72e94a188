#version 330 core
// A surface of a picture, from the pinhole's picture and what lies behind it: light, and signed diameters of discs.
// FRINGE: the foreground's share of mixed pixels. BEHIND: the hidden surface. Otherwise what the eye sees.
#include "field.glsl"

uniform sampler2D pinhole;           // light of the pinhole's picture, weighted by alpha
uniform sampler2D seen;              // its disparity
uniform int top;                     // first row of the surface in the target
uniform float disc_px;               // diameter of a disc, px, for a disparity of 1 px per view step
uniform float texel_px;              // size of a pixel of the views, px of the picture
uniform sampler2D hidden;            // square root of linear light; alpha: whether it is known
uniform sampler2D hidden_disparity;
uniform float hidden_scale;          // factor to the disparity of the views
uniform vec2 hidden_size_px;         // size of the picture in pixels of the hidden disparity
uniform vec2 behind_eye;             // (s, t) of the eye from the hidden surface's viewpoint

in vec2 uv;
layout(location = 0) out vec4 light;
layout(location = 1) out vec4 disc;

const float NOWHERE = 4e6;         // diameter where there is no surface: no slice has it
const float MIN_STEP_PX = 1.0;     // least difference of discs at a depth edge
const float MIN_LEVELS = 2.5;      // the same where a disparity has 8 bits, in its levels
const float SLOPE_SHARE = 0.25;    // as in iibr_core/surfaces.py
const float OUTLINE_SHARE = 0.08;  // as in iibr_core/method/mixed_pixels.py
const float OUTLINE_TRUST = 0.02;  // weight of the outline against colours, squared linear light

float defocus_of(float disparity) {
    float beside = disparity - focus_at(uv);
    return disc_px * sign(beside) * max(abs(beside) - focus_range, 0.0);
}

vec3 light_of(ivec2 at) {
    vec4 sum = texelFetch(pinhole, clamp(at, ivec2(0), textureSize(pinhole, 0) - 1), 0);
    return sum.rgb / max(sum.a, 1e-12);
}

float seen_at(ivec2 at) {
    return texelFetch(seen, clamp(at, ivec2(0), textureSize(seen, 0) - 1), 0).r;
}

// A pixel behind a depth edge shows both surfaces: the foreground's share of it, its disparity, and both lights.
struct Mixed {
    float share, disparity;
    vec3 foreground, background;
};

Mixed mixed_at(ivec2 at) {
    float here = seen_at(at), near = here, far = here, step_px = max(texel_px, 1.0);
    float edge = MIN_STEP_PX / max(disc_px, 1e-9), beside = 0.0;
#ifdef DISPARITY_IN_ALPHA
    edge = max(edge, MIN_LEVELS / 255.0 * (nearest - farthest));
#endif
    vec2 towards = vec2(0.0);
    for (int i = 0; i < 9; i++) {
        vec2 to = vec2(i % 3, i / 3) - 1.0;
        float other = seen_at(at + ivec2(round(step_px * to)));
        near = max(near, other);
        far = min(far, other);
        float is_front = other > here + edge ? 1.0 : 0.0;
        towards += is_front * to;
        beside += is_front;
    }
    vec3 color = light_of(at);
    Mixed mixed = Mixed(0.0, near, color, color);
    if (near - here <= edge || here - far > SLOPE_SHARE * (near - here)) return mixed;
    towards /= max(length(towards), 1e-6);
    vec3 foreground = light_of(at + ivec2(round(2.0 * step_px * towards)));
    vec3 background = light_of(at - ivec2(round(1.5 * step_px * towards)));
    vec3 contrast = foreground - background;
    float share = dot(color - background, contrast) + OUTLINE_TRUST * OUTLINE_SHARE * beside;
    share = clamp(share / (dot(contrast, contrast) + OUTLINE_TRUST), 0.0, 0.95);
    if (share > 0.02) {
        // Both together are the pixel again.
        vec3 left = (color - share * foreground) / (1.0 - share);
        mixed.background = clamp(left, min(background, color), max(background, color));
        mixed.foreground = max((color - (1.0 - share) * mixed.background) / share, 0.0);
        mixed.share = share;
    }
    return mixed;
}

#ifdef BEHIND
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - ivec2(0, top);
    vec2 place = mirrored(uv), eye = (behind_eye + dolly * (place - 0.5)) / hidden_size_px;
    float front = seen_at(at), disparity = front / hidden_scale, last = disparity;
    vec2 found = place;
    for (int i = 0; i < 4; i++) {
        last = disparity;
        found = clamp(place + disparity * eye, 0.0, 1.0);
        disparity = textureLod(hidden_disparity, found, 0.0).r;
    }
    light = vec4(0.0);
    disc = vec4(NOWHERE);
    bool is_found = length((disparity - last) * eye * hidden_size_px) <= 1.0;
    if (!is_found || (front - disparity * hidden_scale) * disc_px <= 0.5) return;
    vec4 root = textureLod(hidden, found, 0.0);
    if (root.a <= 0.5) return;
    light = vec4(light_from_root(root).rgb, 1.0);
    disc = vec4(defocus_of(disparity * hidden_scale));
}
#else
void main() {
    ivec2 at = ivec2(gl_FragCoord.xy) - ivec2(0, top);
    Mixed mixed = mixed_at(at);
#ifdef FRINGE
    light = mixed.share * vec4(mixed.foreground, 1.0);
    disc = vec4(mixed.share > 0.0 ? defocus_of(mixed.disparity) : NOWHERE);
#else
    light = vec4(mixed.background, 1.0);
    disc = vec4(defocus_of(seen_at(at)));
#endif
}
#endif
