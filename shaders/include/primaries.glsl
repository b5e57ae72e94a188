// Light of the stored views' red, green and blue as that of the screen's, or of a file's.
#ifdef OTHER_PRIMARIES
uniform mat3 target_from_source;
vec3 in_target(vec3 light) { return target_from_source * light; }
#else
vec3 in_target(vec3 light) { return light; }
#endif
