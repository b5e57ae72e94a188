// From texture coordinates of the target to those of the picture, of which the target holds a part.
uniform vec4 part;  // left, top, width, height

vec2 picture_uv(vec2 target_uv) {
    return part.xy + target_uv * part.zw;
}
