#version 330 core
// A slice of the surfaces, at a reduced size: light times coverage, coverage.
#include "slices.glsl"

uniform vec4 tent;    // weights by defocus: lower end, 1 / width, upper end, 1 / width
uniform ivec2 origin; // of the target's pixel (0, 0), px of the surfaces
uniform ivec2 corner; // of the slice in the target
uniform int texel;    // side of a pixel of the target, px of the surfaces

out vec4 sum;

// Share of a slice that what the eye sees takes, from which on nothing behind it is in that slice: discs so alike part
// no surfaces, and what is hidden would shine through.
const float IN_FRONT = 0.05;

void main() {
    ivec2 first = origin + (ivec2(gl_FragCoord.xy) - corner) * texel;
    sum = vec4(0.0);
    for (int y = 0; y < texel; y++) {
        for (int x = 0; x < texel; x++) {
            vec4 shown = vec4(0.0);
            for (int surface = 0; surface < SURFACES; surface++) {
                ivec2 place = pixel_of(surface, first + ivec2(x, y));
                float diameter = texelFetch(defocus, place, 0).r;
                float weight = clamp(min((diameter - tent.x) * tent.y, (tent.z - diameter) * tent.w), 0.0, 1.0);
                float room = 1.0 - shown.a;
                if (surface == SURFACES - 1) room *= max(1.0 - shown.a / IN_FRONT, 0.0);
                if (weight * room > 0.0) shown += weight * room * texelFetch(surfaces, place, 0);
            }
            sum += shown;
        }
    }
    sum /= float(texel * texel);
}
