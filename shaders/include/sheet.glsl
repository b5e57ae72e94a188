// Pictures of the same size side by side in one texture, rows bottom-up.
uniform sampler2D sheet;
uniform int sheet_columns;  // pictures in a row of the sheet, the lowest row first
uniform vec2 tile_px;       // room of a picture in the sheet, and its size on the screen
uniform vec2 screen_px;
uniform vec2 frame_px;      // room of each picture on the screen, in whose middle it lies
uniform vec2 drawn_px;      // size at which the pictures are drawn, in the lower left corner of their room

// The colour of picture `index` at a place in it, as shares of its size, y down.
vec3 picture_at(int index, vec2 place) {
    vec2 corner = vec2(index % sheet_columns, index / sheet_columns) * tile_px;
    vec2 texel = clamp(vec2(place.x, 1.0 - place.y) * drawn_px, vec2(0.5), drawn_px - 0.5);
    return textureLod(sheet, (corner + texel) / vec2(textureSize(sheet, 0)), 0.0).rgb;
}
