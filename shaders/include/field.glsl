// The stored views. colors.rgb: square root of linear light; colors.a: disparity, 0..1 from farthest to nearest.
uniform sampler2DArray colors;
uniform sampler2DArray disparities;  // px per view step, nearest texel
uniform vec2 view_size_px;
uniform float nearest, farthest;     // range of disparities, px per view step
uniform float focus_disparity;

vec4 linear_from_stored(vec4 stored) {
    return vec4(stored.rgb * stored.rgb, stored.a);
}

// 1 where a view has the content asked for, next to nothing beyond its border: there, other views know better.
float in_picture(vec2 at) {
    vec2 off_centre = abs(at - 0.5);
    return max(off_centre.x, off_centre.y) > 0.5 ? 1e-4 : 1.0;
}
