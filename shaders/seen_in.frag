#version 330 core
// One pixel a view: whether that view shows a given surface.
uniform sampler2DArray disparities;  // px per view step, nearest texel
uniform sampler2D layers;            // by place in the grid; -1: not there
uniform vec2 view_size_px;
uniform vec2 eye_in_grid;            // (column, row), real
uniform vec2 point_px;               // where the eye sees it
uniform float disparity, tolerance;  // px per view step

out vec4 color;

void main() {
    float layer = texelFetch(layers, ivec2(gl_FragCoord.xy), 0).r;
    vec2 at = (point_px + 0.5 - disparity * (gl_FragCoord.xy - 0.5 - eye_in_grid)) / view_size_px;
    float stored = textureLod(disparities, vec3(at, max(layer, 0.0)), 0.0).r;
    bool is_inside = all(lessThanEqual(abs(at - 0.5), vec2(0.5)));
    color = vec4(layer >= 0.0 && is_inside && abs(stored - disparity) <= tolerance ? 1.0 : 0.0);
}
