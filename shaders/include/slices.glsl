// Slices of defocus, see iibr_core/beyond/lens_slices.py. The surfaces of a picture are stacked in two textures: the
// fringes of mixed pixels, what the eye sees, what lies behind.
const int SURFACES = 3;

uniform sampler2D surfaces;  // linear light times coverage, coverage
uniform sampler2D defocus;   // signed diameters of discs, px
uniform ivec2 area;          // width and height of a surface, px

// A pixel of a surface; the border is repeated.
ivec2 pixel_of(int surface, ivec2 at) {
    return clamp(at, ivec2(0), area - 1) + ivec2(0, surface * area.y);
}
