#version 330 core
// The slices that have something in a block of the picture, a bit for each.
#include "slices.glsl"

const int BINS = 128;

uniform uint bins[BINS];  // slices of equal ranges of defocus
uniform vec2 bin_of;      // index of a bin: x * defocus + y
uniform int block_px;

out uint slices;

void main() {
    ivec2 first = ivec2(gl_FragCoord.xy) * block_px;
    slices = 0u;
    for (int surface = 0; surface < SURFACES; surface++) {
        for (int y = 0; y < block_px; y++) {
            for (int x = 0; x < block_px; x++) {
                ivec2 at = pixel_of(surface, first + ivec2(x, y));
                int bin = clamp(int(bin_of.x * texelFetch(defocus, at, 0).r + bin_of.y), 0, BINS - 1);
                slices |= texelFetch(surfaces, at, 0).a > 0.0 ? bins[bin] : 0u;
            }
        }
    }
}
