#version 300 es
// Replaces the first line of the desktop's shaders: WebGL 2 needs the precision of every type.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
precision highp usampler2D;
#define DISPARITY_IN_ALPHA 1
