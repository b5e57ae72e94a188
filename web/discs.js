// Blurs a pinhole's picture as an open lens does, by the desktop's shaders: viewer/gpu/refocus/discs.py has the same names
// and numbers and explains them.

import { NUMBERS, tentsOf } from "./slices.js";

const TILE_PX = 512, MAX_ATLAS_PX = 4096, BLOCK_PX = 32, MAX_REACH_BLOCKS = 7, BINS = 128, BARREL_EDGE = 1 / 16;
const SURFACES = ["FRINGE", "", "BEHIND"];
const both = (of) => [of(0), of(1)];

export class Discs {
    constructor(renderer) {
        this.renderer = renderer;
        this.taps = renderer.gl.createBuffer();
    }

    // Draws the picture of an open lens into a sheet of the renderer, a tile a step. picture: see `Renderer.begin`.
    *steps(picture, into) {
        const { lens: { slices }, width, height } = picture;
        this.picture = picture;
        this.tents = tentsOf(slices);
        const farthest = Math.max(...slices.map(({ reachPx, level }) => reachPx + 2 * 2 ** level));
        this.blockPx = BLOCK_PX;
        while (farthest > (MAX_REACH_BLOCKS - 1) * this.blockPx) this.blockPx *= 2;
        this.writeTaps(slices);
        this.drawSurfaces(picture);
        this.drawOccupancy(picture);
        for (let top = 0; top < height; top += TILE_PX) {
            for (let left = 0; left < width; left += TILE_PX) {
                this.drawTile([left, top], [Math.min(left + TILE_PX, width), Math.min(top + TILE_PX, height)], into);
                yield;
            }
        }
    }

    writeTaps(slices) {
        const { gl } = this.renderer, table = new Float32Array(4 * NUMBERS.MAX_TAPS * NUMBERS.MAX_SLICES);
        slices.forEach(({ taps }, i) => taps.forEach((tap, j) => table.set(tap, 4 * (i * NUMBERS.MAX_TAPS + j))));
        gl.bindBuffer(gl.UNIFORM_BUFFER, this.taps);
        gl.bufferData(gl.UNIFORM_BUFFER, table, gl.DYNAMIC_DRAW);
    }

    drawSurfaces({ lens, region, values }) {
        const { renderer } = this, { gl, hidden } = renderer, { width, height } = region;
        const size = [width, SURFACES.length * height];
        const light = renderer.sheet("light", gl.RGBA16F, ...size, ["light", "defocus"]);
        renderer.sheet("defocus", gl.R16F, ...size, ["light", "defocus"]);
        renderer.clear(light);
        SURFACES.forEach((name, i) => {
            if (name === "BEHIND" && !hidden) return;
            const target = { ...light, y: i * height, height };
            renderer.draw(["surfaces.frag", name, lens.gain > 0 && "HIGHLIGHTS"], target, {
                ...values, top: i * height, disc_px: lens.discPx, texel_px: lens.texelPx, hidden_scale: 1,
                hidden_size_px: values.view_size_px, behind_eye: [lens.eye.s, values.view_step[1] * lens.eye.t],
            }, {
                pinhole: renderer.sheets.pinhole, seen: renderer.sheets.seen,
                hidden: hidden?.colors, hidden_disparity: hidden?.disparity,
            });
        });
    }

    drawOccupancy({ lens: { slices }, region }) {
        const { renderer, tents, blockPx } = this, { gl } = renderer, blocks = (px) => Math.ceil(px / blockPx);
        const target = renderer.sheet("occupancy", gl.R32UI, blocks(region.width), blocks(region.height));
        const near = slices[0].diameterPx, far = slices.at(-1).diameterPx, scale = (BINS - 2) / Math.max(near - far, 1e-6);
        const bins = Array.from({ length: BINS }, (_, bin) => tents.reduce((bits, [low, , high], i) => {
            const meets = bin + 0.01 > (low - far) * scale && bin - 1 - 0.01 < (high - far) * scale;
            return bits | (meets ? 1 << i : 0);
        }, 0));
        const values = { ...this.area(), "bins[0]": bins, bin_of: [scale, 1 - far * scale], block_px: blockPx };
        renderer.draw(["occupancy.frag"], target, values, this.surfaces());
    }

    area = () => ({ area: [this.picture.region.width, this.picture.region.height] });

    surfaces() {
        const { light, defocus, occupancy } = this.renderer.sheets;
        return { surfaces: light, defocus, occupancy };
    }

    // start, end: corners of the tile, px of the picture.
    drawTile(start, end, into) {
        const { renderer, picture: { lens } } = this, { gl } = renderer, { places, sizes } = this.placesOf(start, end);
        const [sheet, blurred] = ["slices", "blurred"].map((name, i) => renderer.sheet(name, gl.RGBA16F, ...sizes[i]));
        this.drawSlices(places, sheet);
        this.blurSlices(places, blurred);
        const table = Array(4 * NUMBERS.MAX_SLICES).fill(0);
        for (const { index, target, first, texel } of places) {
            table.splice(4 * index, 3, ...both((i) => target[i] + (lens.marginPx - first[i]) / texel), 1 / texel);
        }
        const box = {
            corner: start, size: both((i) => end[i] - start[i]), origin: both((i) => start[i] + lens.marginPx), texel: 1,
        };
        const reach = Math.max(...places.map((place) => place.reach));
        this.drawBlocks(["composite.frag"], into, box, wantedBy(places), reach, { "places[0]": table }, { atlas: blurred });
    }

    // Returns where the slices of a tile lie, and the sizes of both sheets.
    placesOf(start, end) {
        const { picture: { lens: { slices, marginPx } }, blockPx } = this, shelves = [new Shelves(), new Shelves()];
        const places = slices.map((slice, index) => {
            const texel = 2 ** slice.level, pad = Math.ceil(slice.reach) + 1, beside = slice.level ? 2 : 0;
            const from = both((i) => Math.floor((start[i] + marginPx) / texel) - beside);
            const blurredSize = both((i) => Math.ceil((end[i] + marginPx) / texel) + beside - from[i]);
            const size = blurredSize.map((extent) => extent + 2 * pad);
            return {
                index, slice, texel, pad, size, blurredSize, source: shelves[0].add(...size),
                target: shelves[1].add(...blurredSize), origin: from.map((place) => (place - pad) * texel),
                first: from.map((place) => place * texel), reach: Math.ceil((slice.reachPx + texel) / blockPx),
            };
        });
        return { places, sizes: shelves.map((each) => each.size()) };
    }

    drawSlices(places, sheet) {
        this.renderer.clear(sheet);
        for (const { index, texel, origin, source, size } of places) {
            const values = { ...this.area(), tent: this.tents[index], origin, corner: source, texel };
            const wanted = Array(MAX_REACH_BLOCKS + 1).fill(1 << index), box = { corner: source, size, origin, texel };
            this.drawBlocks(["slice.frag"], sheet, box, wanted, Number(texel > this.blockPx), values, this.surfaces());
        }
    }

    blurSlices(places, blurred) {
        const { renderer, picture: { lens } } = this, { gl, sheets } = renderer, bytes = 16 * NUMBERS.MAX_TAPS;
        const program = ["disc.frag", lens.shape.kind === "cat_eye" && "CAT_EYE"];
        renderer.clear(blurred);
        for (const place of places) {
            const { index, slice: { taps }, source, target, pad, blurredSize: size, first: origin, texel } = place;
            gl.bindBufferRange(gl.UNIFORM_BUFFER, 0, this.taps, index * bytes, bytes);
            const shift = both((i) => source[i] + pad - target[i]), box = { corner: target, size, origin, texel };
            const values = { tap_count: taps.length, shift, ...this.barrelOf(place) };
            this.drawBlocks(program, blurred, box, wantedBy([place]), place.reach, values, { atlas: sheets.slices });
        }
    }

    // Returns the uniforms of a cat's-eye, see disc.frag.
    barrelOf({ slice: { diameterPx }, texel, first, target }) {
        const { picture: { lens, part, width, height }, renderer: { field } } = this;
        const radius = Math.max(Math.abs(diameterPx) / 2 / texel, 1e-6), aspect = field.height / field.width;
        const moved = 2 * lens.shape.cat_eye / Math.hypot(1, aspect), px = [part.width / width, part.height / height];
        const start = both((i) => [part.x, part.y][i] + (first[i] - lens.marginPx - target[i] * texel) * px[i]);
        return {
            barrel: [moved, moved * aspect, 1], lens_of_px: Math.sign(diameterPx || 1) / radius,
            barrel_edge: Math.max(2 * BARREL_EDGE, 1 / radius), uv_of_px: [...start, texel * px[0], texel * px[1]],
        };
    }

    // Draws the blocks of a box of a sheet in which slices have something within reach, see blocks.vert. corner: first
    // pixel of the box; origin: the same in the surfaces, px; texel: side of a pixel, px of the surfaces.
    drawBlocks(program, sheet, { corner, size, origin, texel }, wanted, reach, values, textures) {
        const { renderer, blockPx } = this, { gl } = renderer, step = blockPx / texel, extent = [sheet.width, sheet.height];
        const first = both((i) => Math.floor(origin[i] / blockPx));
        const count = both((i) => Math.ceil((origin[i] + size[i] * texel) / blockPx) - first[i]);
        const place = both((i) => 2 * (corner[i] - origin[i] / texel) / extent[i] - 1);
        const { occupancy } = renderer.sheets;
        gl.enable(gl.SCISSOR_TEST);
        gl.scissor(...corner, ...size);
        renderer.draw(program, sheet, {
            ...values, "wanted[0]": wanted, reach, blocks: [...first, ...count],
            target_of_blocks: [...place, ...both((i) => 2 * step / extent[i])],
        }, { occupancy, ...textures }, "blocks.vert", 6 * count[0] * count[1]);
        gl.disable(gl.SCISSOR_TEST);
    }
}

// Returns the slices that reach so many blocks, a bit for each.
function wantedBy(places) {
    return Array.from({ length: MAX_REACH_BLOCKS + 1 }, (_, away) => (
        places.reduce((bits, { index, reach }) => bits | (away <= reach ? 1 << index : 0), 0)));
}

// Places rectangles below each other, in columns.
class Shelves {
    left = 0;
    width = 0;
    top = 0;
    height = 0;

    add(width, height) {
        if (this.top + height > MAX_ATLAS_PX) Object.assign(this, { left: this.left + this.width, width: 0, top: 0 });
        const corner = [this.left, this.top];
        this.top += height;
        this.width = Math.max(this.width, width);
        this.height = Math.max(this.height, this.top);
        return corner;
    }

    size = () => [64 * Math.ceil((this.left + this.width) / 64), 256 * Math.ceil(this.height / 256)];
}
