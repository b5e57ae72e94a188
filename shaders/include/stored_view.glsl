// Stored views as they are, for looking at: no lens, no parallax.
#include "srgb.glsl"
#include "primaries.glsl"

uniform sampler2DArray colors;  // rgb: square root of linear light
uniform float exposure;         // factor

// A colour on the screen from a sum of roots of light.
vec3 shown(vec3 root) {
    return srgb_from_linear(clamp(in_target(root * root * exposure), 0.0, 1.0));
}

// The stand-in for a view that has not come yet: grey, with lines across it.
vec3 missing() {
    float place = mod(gl_FragCoord.x + gl_FragCoord.y, 8.0);
    return vec3(place < 2.0 ? 0.42 : 0.32);
}
