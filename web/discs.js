// Blurs a pinhole's picture as an open lens does, by the desktop's shaders: viewer/gpu/refocus/discs.py has the same names
// and numbers and explains them.

import { NUMBERS, tentsOf } from "./slices.js";

const TILE_PX = 512, MAX_ATLAS_PX = 4096, BLOCK_PX = 16, MAX_REACH_BLOCKS = 12, ALIGNED_PX = 4, BINS = 128;
const BARREL_EDGE = 1 / 16;
const SURFACES = ["FRINGE", "", "BEHIND"];
const both = (of) => [of(0), of(1)];
const multiple = (x, step) => step * Math.ceil(x / step);

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
        this.reachPx = slices.map(({ reachPx, level }) => reachPx + 2 ** level);
        this.blockPx = Math.max(BLOCK_PX, ...slices.map(({ level }) => 2 ** level));
        while (Math.max(...this.reachPx) > MAX_REACH_BLOCKS * this.blockPx) this.blockPx *= 2;
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
        const { gl } = this.renderer, table = new Float32Array(4 * NUMBERS.MAX_TAPS * slices.length);
        slices.forEach(({ taps }, i) => taps.forEach((tap, j) => table.set(tap, 4 * (i * NUMBERS.MAX_TAPS + j))));
        gl.bindBuffer(gl.UNIFORM_BUFFER, this.taps);
        gl.bufferData(gl.UNIFORM_BUFFER, table, gl.DYNAMIC_DRAW);
    }

    drawSurfaces({ lens, region, values }) {
        const { renderer } = this, { gl, hidden } = renderer, { width, height } = region;
        const size = [width, SURFACES.length * height];
        const light = renderer.sheet("light", gl.RGBA16F, ...size, ["light", "defocus"]);
        renderer.sheet("defocus", renderer.isFloat ? gl.R32F : gl.R16F, ...size, ["light", "defocus"]);
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
        const wanted = Array.from({ length: MAX_REACH_BLOCKS }, (_, away) => (
            this.reachPx.reduce((bits, px, i) => bits | (px > away * blockPx ? 1 << i : 0), 0)));
        const reached = renderer.sheet("reach", gl.R32UI, blocks(region.width), blocks(region.height));
        const reach = Math.ceil(Math.max(...this.reachPx) / blockPx);
        renderer.draw(["reach.frag"], reached, { "wanted[0]": wanted, reach }, { occupancy: target });
    }

    area = () => ({ area: [this.picture.region.width, this.picture.region.height] });

    surfaces() {
        const { light, defocus } = this.renderer.sheets;
        return { surfaces: light, defocus };
    }

    // start, end: corners of the tile, px of the picture.
    drawTile(start, end, into) {
        const { renderer, picture: { lens } } = this, { gl } = renderer, { places, sizes } = this.placesOf(start, end);
        const [sheet, blurred] = ["slices", "blurred"].map((name, i) => renderer.sheet(name, gl.RGBA16F, ...sizes[i]));
        [sheet, blurred].forEach((each, i) => renderer.clear(each, sizes[i]));
        this.drawSlices(places, sheet);
        this.blurSlices(places, blurred);
        const table = Array(4 * NUMBERS.MAX_SLICES).fill(0);
        for (const { index, target, first, texel } of places) {
            table.splice(4 * index, 3, ...both((i) => target[i] + (lens.marginPx - first[i]) / texel), 1 / texel);
        }
        const box = {
            corner: start, size: both((i) => end[i] - start[i]), origin: both((i) => start[i] + lens.marginPx), texel: 1,
        };
        const textures = { atlas: blurred, occupancy: renderer.sheets.reach };
        this.drawBlocks(["composite.frag"], into, box, 2 ** lens.slices.length - 1, { "places[0]": table }, textures);
    }

    // Returns where the slices of a tile lie, and the sizes of both sheets.
    placesOf(start, end) {
        const { picture: { lens: { slices, marginPx } }, blockPx } = this, shelves = [new Shelves(), new Shelves()];
        const places = slices.map(({ level, taps, diameterPx, reachPx }, index) => {
            const texel = 2 ** level, unit = this.pointBlocks(texel) * blockPx, beside = level ? texel : 0;
            const low = both((i) => Math.floor((blockPx * Math.floor((start[i] + marginPx) / blockPx) - beside) / unit));
            const high = both((i) => Math.ceil((multiple(end[i] + marginPx, blockPx) + beside) / unit));
            const pad = Math.ceil(reachPx / unit), sizeOf = (more) => both((i) => (high[i] - low[i] + 2 * more) * unit / texel);
            const size = sizeOf(pad), blurredSize = sizeOf(0);
            return {
                index, taps, diameterPx, texel, size, blurredSize, pad: pad * unit / texel,
                source: shelves[0].add(...size), target: shelves[1].add(...blurredSize),
                origin: low.map((place) => (place - pad) * unit), first: low.map((place) => place * unit),
            };
        });
        return { places, sizes: shelves.map((each) => each.size()) };
    }

    // Returns the side of a point in blocks, so that it has ALIGNED_PX pixels at least.
    pointBlocks = (texel) => Math.max(Math.floor(ALIGNED_PX * texel / this.blockPx), 1);

    drawSlices(places, sheet) {
        for (const { index, texel, origin, source, size } of places) {
            const values = { ...this.area(), tent: this.tents[index], origin, corner: source, texel };
            const box = { corner: source, size, origin, texel }, { occupancy } = this.renderer.sheets;
            this.drawBlocks(["slice.frag"], sheet, box, 1 << index, values, { ...this.surfaces(), occupancy });
        }
    }

    blurSlices(places, blurred) {
        const { renderer, picture: { lens } } = this, { gl, sheets } = renderer, bytes = 16 * NUMBERS.MAX_TAPS;
        const program = ["disc.frag", lens.shape.kind === "cat_eye" && "CAT_EYE"];
        for (const place of places) {
            const { index, taps, source, target, pad, blurredSize: size, first: origin, texel } = place;
            gl.bindBufferRange(gl.UNIFORM_BUFFER, 0, this.taps, index * bytes, bytes);
            const shift = both((i) => source[i] + pad - target[i]), box = { corner: target, size, origin, texel };
            const values = { tap_count: taps.length, shift, ...this.barrelOf(place) };
            const textures = { atlas: sheets.slices, occupancy: sheets.reach };
            this.drawBlocks(program, blurred, box, 1 << index, values, textures);
        }
    }

    // Returns the uniforms of a cat's-eye, see disc.frag.
    barrelOf({ diameterPx, texel, first, target }) {
        const { picture: { lens, part, width, height }, renderer: { field } } = this;
        const radius = Math.max(Math.abs(diameterPx) / 2 / texel, 1e-6), aspect = field.height / field.width;
        const moved = 2 * lens.shape.cat_eye / Math.hypot(1, aspect), px = [part.width / width, part.height / height];
        const start = both((i) => [part.x, part.y][i] + (first[i] - lens.marginPx - target[i] * texel) * px[i]);
        return {
            barrel: [moved, moved * aspect, 1], lens_of_px: Math.sign(diameterPx || 1) / radius,
            barrel_edge: Math.max(2 * BARREL_EDGE, 1 / radius), uv_of_px: [...start, texel * px[0], texel * px[1]],
        };
    }

    // Draws the blocks of a box of a sheet that have some of the wanted slices, a bit for each, see blocks.vert. corner:
    // first pixel of the box; origin: the same in the surfaces, px; texel: side of a pixel, px of the surfaces.
    drawBlocks(program, { framebuffer }, { corner, size, origin, texel }, wanted, values, textures) {
        const { renderer, blockPx } = this, { gl } = renderer, blocks = this.pointBlocks(texel), px = blocks * blockPx;
        const first = both((i) => Math.floor(origin[i] / px)), side = px / texel;
        const [across, down] = both((i) => Math.ceil((origin[i] + size[i] * texel) / px) - first[i]);
        const [x, y] = both((i) => corner[i] - (origin[i] - first[i] * px) / texel);
        gl.enable(gl.SCISSOR_TEST);
        gl.scissor(...corner, ...size);
        const points = { points: [...first, across, down], point_blocks: blocks, point_px: side, wanted };
        const box = { framebuffer, x, y, width: across * side, height: down * side };
        renderer.draw(program, box, { ...values, ...points }, textures, "blocks.vert", across * down);
        gl.disable(gl.SCISSOR_TEST);
    }
}

// Places rectangles below each other, in columns, on whole multiples of ALIGNED_PX.
class Shelves {
    left = 0;
    width = 0;
    top = 0;
    height = 0;

    add(width, height) {
        if (this.top + height > MAX_ATLAS_PX) Object.assign(this, { left: this.left + multiple(this.width, ALIGNED_PX), width: 0, top: 0 });
        const corner = [this.left, this.top];
        this.top += multiple(height, ALIGNED_PX);
        this.width = Math.max(this.width, width);
        this.height = Math.max(this.height, this.top);
        return corner;
    }

    size = () => [multiple(this.left + this.width, 64), multiple(this.height, 256)];
}
