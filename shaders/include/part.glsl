// From texture coordinates of the target to those of the picture. PART: the target holds a part of it only.
#ifdef PART
uniform vec4 part;  // left, top, width, height

vec2 picture_uv(vec2 target_uv) {
    return part.xy + target_uv * part.zw;
}
#else
vec2 picture_uv(vec2 target_uv) {
    return target_uv;
}
#endif
