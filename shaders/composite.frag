#version 330 core
// The blurred slices of a picture, composited from near to far.
const int MAX_SLICES = 32;
const float HIDES = 1e-3;    // share of light that passes, up to which nothing behind is seen
const float OPEN_AT = 0.05;  // coverage from which on a slice continues the surface before it

uniform sampler2D atlas;           // blurred slices
uniform vec4 places[MAX_SLICES];   // pixel of the atlas: xy + z * pixel of the target

flat in uint slices;
out vec4 sum;

void main() {
    vec2 size = vec2(textureSize(atlas, 0));
    vec3 light = vec3(0.0);
    // What passes the surfaces that are complete, and how much of the rest the last one covers. Neighbouring slices of
    // one surface add up; surfaces apart hide each other by chance.
    float passed = 1.0, covered = 0.0;
    uint left = slices;
    int last = -1;
    while (left != 0u && passed * (1.0 - covered) > HIDES) {
        uint lowest = left & (~left + 1u);
        left ^= lowest;
        int k = int(log2(float(lowest)) + 0.5);
        // A slice that is not near interrupts a surface as one without coverage here does.
        if (k > last + 1) {
            passed *= 1.0 - covered;
            covered = 0.0;
        }
        last = k;
        vec4 slice = textureLod(atlas, (places[k].xy + places[k].z * gl_FragCoord.xy) / size, 0.0);
        float alpha = clamp(slice.a, 0.0, 1.0), stays_open = min(alpha / OPEN_AT, 1.0);
        float closed = 1.0 - (1.0 - stays_open) * covered;
        passed *= closed;
        covered = stays_open * covered / max(closed, 1e-6);
        float shown = min(alpha, 1.0 - covered);
        light += passed * shown * max(slice.rgb, 0.0) / max(slice.a, 1e-6);
        covered += shown;
    }
    sum = vec4(light, max(1.0 - passed * (1.0 - covered), 1e-6));
}
