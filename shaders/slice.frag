#version 330 core
// A slice of the surfaces, at a reduced size: light times coverage, coverage.
#include "slices.glsl"

uniform vec4 tent;    // weights by defocus: lower end, 1 / width, upper end, 1 / width
uniform ivec2 origin; // of the target's pixel (0, 0), px of the surfaces
uniform ivec2 corner; // of the slice in the target
uniform int texel;    // side of a pixel of the target, px of the surfaces

out vec4 sum;

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
                if (weight > 0.0) shown += (1.0 - shown.a) * weight * texelFetch(surfaces, place, 0);
            }
            sum += shown;
        }
    }
    sum /= float(texel * texel);
}
