#version 300 es
// In place of the desktop's first line: the same shaders in WebGL 2, which asks for the precision of everything.
precision highp float;
precision highp int;
precision highp sampler2D;
precision highp sampler2DArray;
#define DISPARITY_IN_ALPHA 1
