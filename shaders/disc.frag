#version 330 core
// A slice, blurred by its disc.
const int MAX_TAPS = 768;

layout(std140) uniform Taps {
    vec4 taps[MAX_TAPS];  // x, y from the middle, px of the slice; weight
};
uniform int tap_count;
uniform sampler2D atlas;  // slices
uniform vec2 shift;       // from a pixel of the target to that of the slice
#ifdef CAT_EYE
uniform vec3 barrel;      // see lens.frag, in radii of the opening
uniform float lens_of_px; // radii of the opening for a pixel of the slice
uniform float barrel_edge;
uniform vec4 uv_of_px;    // place in the picture: xy + zw * pixel of the target
#endif

out vec4 sum;

void main() {
    vec2 at = gl_FragCoord.xy + shift, size = vec2(textureSize(atlas, 0));
    sum = vec4(0.0);
    float total = 0.0;
    int i = 0;
    do {
        float weight = taps[i].z;
#ifdef CAT_EYE
        vec2 uv = uv_of_px.xy + uv_of_px.zw * gl_FragCoord.xy;
        float inside = barrel.z - length(taps[i].xy * lens_of_px - barrel.xy * (uv - 0.5));
        weight *= clamp(0.5 + inside / barrel_edge, 1e-6, 1.0);
#endif
        sum += weight * textureLod(atlas, (at + taps[i].xy) / size, 0.0);
        total += weight;
    } while (++i < tap_count);
    sum /= total;
}
