// Draws a light field through a virtual lens, by the desktop's shaders in WebGL 2. Offsets are { t, s } in view steps
// (down, right), disparities px per view step, as in the core. Names, numbers and their reasons are those of
// viewer/gpu/refocus, where everything is explained at length.

const MAX_SAMPLES = 512, MAX_SOURCES = 4, MAX_SEARCH_STEPS = 96, TILE_PX = 16, BLOCK_PX = 16, MAX_TILE_TAPS = 8;
const MAX_PASSES = 16, ONE_PASS_UP_TO_PX = 1.75, PASS_BLUR_PX = 1.5, LEAST_PASSES = 4;
const STILL_SAMPLES = 600, EDGE_PASSES = 5;
const FADE_FROM_PX = 4, FADE_TO_PX = 6, LEAST_ACROSS = 2, SPARSE_UP_TO_PX = 1.2, OFF_BORDER_PX = 1 / 256;
const LEAST_WEIGHT = 2e-4, LEAST_SCALE = 0.4, FINE = 48, HALVINGS = 14;
export const LEVELS = [[1, 4, 1], [1, 2, 1], [1, 1, 1], [1, 1, 0.7], [1, 1, 0.5], [2, 1, 0.7], [2, 1, 0.5], [3, 1, 0.5],
    [4, 1, 0.35]].map(([stride, sources, scale]) => ({ stride, sources, scale }));
export const WHOLE = { x: 0, y: 0, width: 1, height: 1 };

export const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
export const hash = (place) => `${place.t},${place.s}`;

// ---- Which stored views a picture is made of: plain numbers, see view_sampling.py. field: { rows, columns, width,
// height, range, hasDisparity, step, layers }; step: between views that are there, in view steps, the middle one among
// them; layers: theirs, by "t,s".

// The first and the last offset along an axis of so many views, of those that are there.
const ends = (count, step) => [-(count >> 1), count - 1 - (count >> 1)].map((end) => Math.trunc(end / step) * step);

function bracket(x, count, step) {
    const [first, last] = ends(count, step), inside = clamp(x, first, last);
    const low = clamp(Math.floor(inside / step) * step, first, Math.max(last - step, first));
    const share = (inside - low) / step;
    return [[low, 1 - share], [low + step, share]].filter(([, weight]) => weight > 0);
}

// Up to four views around the eye, bilinear, the heaviest first.
export function pinholeSources(eye, { rows, columns, step }) {
    const across = bracket(eye.s, columns, step);
    return bracket(eye.t, rows, step).flatMap(([t, wt]) => across.map(([s, ws]) => ({ t, s, weight: wt * ws })))
        .sort((a, b) => b.weight - a.weight);
}

function nearestView({ t, s }, { rows, columns, step }) {
    const nearest = (x, count) => clamp(step * Math.floor(x / step + 0.5), ...ends(count, step));
    return { t: nearest(t, rows), s: nearest(s, columns) };
}

const sumOf = (weighted) => weighted.reduce((sum, one) => sum + one.weight, 0);

function openness(t, s, diameter, widest, width) {
    const within = clamp(0.5 + (widest / 2 - Math.max(Math.abs(t), Math.abs(s))) / width, 0, 1);
    return Math.min(clamp(0.5 + (diameter / 2 - Math.hypot(t, s)) / width, 0, 1), within);
}

function secondMoment(places, weight) {
    let total = 0, moment = 0;
    for (const t of places.t) {
        for (const s of places.s) {
            const w = weight(t, s);
            total += w;
            moment += w * (t * t + s * s);
        }
    }
    return total > 0 ? moment / total / 2 : 0;
}

// How much smaller an opening is taken, so that its samples blur like the opening itself: see aperture_moments.py.
export function scaleOf(place, diameter, widest, stride, isSmoothed) {
    const most = Math.trunc(Math.min(diameter, widest) / 2 / stride) + 2, width = Math.min(stride, diameter);
    const around = (start) => Array.from({ length: 2 * most + 1 }, (_, i) => start + stride * (i - most));
    const lattice = { t: around(place.t), s: around(place.s) }, cut = Math.min(widest / diameter, 1);
    const fine = Array.from({ length: FINE }, (_, i) => cut * ((i + 0.5) / FINE - 0.5));
    const own = diameter ** 2 * secondMoment({ t: fine, s: fine }, (t, s) => openness(t, s, 1, cut, cut / FINE));
    const wanted = Math.max(own - (isSmoothed ? width ** 2 / 12 : 0), 0) / clamp(diameter - 1, 1e-3, 1);
    const tooWide = (scale) =>
        secondMoment(lattice, (t, s) => openness(t, s, scale * diameter, scale * widest, width)) - wanted;
    let low = LEAST_SCALE, high = 1;
    if (tooWide(high) <= 0) return high;
    for (let k = 0; k < HALVINGS; k++) {
        const middle = (low + high) / 2;
        [low, high] = tooWide(middle) > 0 ? [low, middle] : [middle, high];
    }
    return low;
}

export function apertureSamples(eye, diameter, field, stride = 1, moved = { t: 0, s: 0 }, isSmoothed = false) {
    const width = Math.min(stride, diameter), most = Math.max(field.rows, field.columns);
    const beside = (x) => x - stride * Math.round(x / stride);
    const place = { t: beside(moved.t - eye.t), s: beside(moved.s - eye.s) };
    const scale = scaleOf(place, diameter, most, stride, isSmoothed), widest = scale * most;
    diameter *= scale;
    const reach = Math.min(diameter, widest) / 2 + stride;
    const lattice = (middle, start) => {
        const [first, last] = [Math.ceil((middle - reach - start) / stride), (middle + reach - start) / stride];
        return Array.from({ length: Math.floor(last) - first + 1 }, (_, i) => start + stride * (first + i));
    };
    const across = lattice(eye.s, moved.s);
    const all = lattice(eye.t, moved.t).flatMap((t) => across.map((s) => (
        { t, s, weight: openness(t - eye.t, s - eye.s, diameter, widest, width) })));
    const total = sumOf(all), chosen = all.filter((sample) => sample.weight > LEAST_WEIGHT * total);
    const kept = sumOf(chosen);
    return chosen.map(({ t, s, weight }) => ({ t, s, weight: weight / kept, ...answered({ t, s }, field) }));
}

function answered(place, field) {
    const stored = nearestView(place, field);
    return { stored, isDirect: stored.t === place.t && stored.s === place.s };
}

export function lensOf(optics, field, widthPx, level = LEVELS[0]) {
    const diameter = Math.max(optics.aperture, 0), [far, near] = field.range;
    const stride = Math.min(level.stride, Math.max(Math.trunc(diameter / LEAST_ACROSS), 1));
    const step = Math.max(Math.min(diameter, stride), 1e-6);
    const blurPx = diameter > 0 ? step * widthPx / field.width : 0;
    const across = Math.max(Math.min(diameter, Math.max(field.rows, field.columns)) / step, 1);
    const beside = Math.max(Math.abs(far - optics.focus), Math.abs(near - optics.focus));
    return {
        ...optics, diameter, stride, blurPx, widestBlurPx: blurPx * beside, share: clamp(diameter - 1, 0, 1),
        keepsLayers: field.hasDisparity && Math.max(blurPx, blurPx * across / FADE_FROM_PX) * beside > 1,
        sharpUpTo: [Math.min(1, FADE_FROM_PX / across), Math.min(2, FADE_TO_PX / across)],
        sparseUpToPx: SPARSE_UP_TO_PX / across, mostSources: level.sources,
    };
}

export function passPlaces(lens, field) {
    const isStored = field.layers.has(hash(lens.eye));
    let count = 1;
    if (lens.share > 0 && lens.keepsLayers && lens.widestBlurPx > ONE_PASS_UP_TO_PX) {
        const samples = samplesOf(lens, field, { t: 0, s: 0 }).length;
        const close = Math.ceil((lens.widestBlurPx / PASS_BLUR_PX) ** 2);
        count = Math.min(Math.max(close, LEAST_PASSES), MAX_PASSES, Math.trunc(STILL_SAMPLES / samples));
    }
    if (lens.share < 1 && field.hasDisparity && !isStored) count = Math.max(count, EDGE_PASSES);
    return Array.from({ length: Math.max(count, 1) }, (_, k) => ({  // the R2 sequence
        t: (k * 0.7548776662466927 + 0.5) % 1 - 0.5, s: (k * 0.5698402909980532 + 0.5) % 1 - 0.5,
    }));
}

function samplesOf(lens, field, moved, coarser = 1, isSmoothed = true) {
    const { eye, diameter, stride, keepsLayers } = lens;
    return apertureSamples(eye, diameter, field, stride * coarser, moved, isSmoothed && keepsLayers);
}

// Those of a pass in the order they are drawn: what suffices where all is sharp first, `sparse` its weight.
export function samplesOfPass(lens, field, place, passIndex) {
    const moved = { t: lens.stride * place.t, s: lens.stride * place.s };
    const all = samplesOf(lens, field, moved, 1, passIndex < 1);
    const wanted = new Set(all.map(hash));
    const coarse = samplesOf(lens, field, moved, 2, false).filter((sample) => wanted.has(hash(sample)));
    const total = sumOf(coarse), sparse = new Map(coarse.map((sample) => [hash(sample), sample.weight / total]));
    const rank = (sample) => 2 * !sparse.has(hash(sample)) + !sample.isDirect;
    return all.map((sample) => ({ ...sample, sparse: sparse.get(hash(sample)) })).sort((a, b) => rank(a) - rank(b));
}

// Disparity at a place of the picture (0..1) as the eye sees it: the first surface met in the middle view.
export function pick(field, middle, eye, u, v) {
    const [far, near] = field.range, { width, height } = field;
    const steps = 2 * Math.ceil(Math.max(Math.abs(eye.s), Math.abs(eye.t)) * (near - far)) + 1;
    for (let k = 0; ; k++) {
        const disparity = near - (near - far) * k / steps;
        const x = clamp(Math.floor(u * width + disparity * eye.s), 0, width - 1);
        const y = clamp(Math.floor(v * height + disparity * eye.t), 0, height - 1);
        const seen = far + (near - far) * middle[y * width + x] / 255;
        if (seen >= disparity || k >= steps) return seen;
    }
}

// ---- WebGL 2: programs of the desktop's shaders, textures, targets

class Program {
    constructor(gl, vertex, fragment, name) {
        this.gl = gl;
        this.program = gl.createProgram();
        for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
            const shader = gl.createShader(kind);
            gl.shaderSource(shader, source);
            gl.compileShader(shader);
            gl.attachShader(this.program, shader);
        }
        gl.linkProgram(this.program);
        if (!gl.getProgramParameter(this.program, gl.LINK_STATUS)) {
            const logs = gl.getAttachedShaders(this.program).map((shader) => gl.getShaderInfoLog(shader));
            throw new Error(`${name}: ${gl.getProgramInfoLog(this.program)} ${logs.join(" ")}`);
        }
        this.uniforms = new Map();
        for (let i = gl.getProgramParameter(this.program, gl.ACTIVE_UNIFORMS) - 1; i >= 0; i--) {
            const { name: full, type } = gl.getActiveUniform(this.program, i);
            const put = {
                [gl.FLOAT]: "uniform1fv", [gl.FLOAT_VEC2]: "uniform2fv", [gl.FLOAT_VEC4]: "uniform4fv",
            }[type] ?? "uniform1iv";  // integers and samplers
            const place = gl.getUniformLocation(this.program, full);
            if (place) this.uniforms.set(full.replace("[0]", ""), (value) => gl[put](place, [value].flat(2)));
        }
        const block = gl.getUniformBlockIndex(this.program, "Samples");
        if (block !== gl.INVALID_INDEX) gl.uniformBlockBinding(this.program, block, 0);
    }

    // textures: by the names of their samplers. Names that the compiler left out are skipped.
    use(values, textures = {}) {
        const { gl } = this;
        gl.useProgram(this.program);
        Object.entries(textures).forEach(([name, [target, texture]], unit) => {
            gl.activeTexture(gl.TEXTURE0 + unit);
            gl.bindTexture(target, texture);
            this.uniforms.get(name)?.(unit);
        });
        for (const [name, value] of Object.entries(values)) this.uniforms.get(name)?.(value);
    }
}

export class Renderer {
    constructor(canvas, shaders, field) {
        const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, preserveDrawingBuffer: true });
        if (!gl || !gl.getExtension("EXT_color_buffer_float")) throw new Error("no WebGL 2 that draws floats");
        const isWhole = gl.getExtension("EXT_float_blend") && gl.getExtension("OES_texture_float_linear");
        Object.assign(this, { gl, canvas, shaders, field, programs: new Map(), made: [] });
        this.floats = isWhole ? gl.RGBA32F : gl.RGBA16F;
        if ("drawingBufferColorSpace" in gl) gl.drawingBufferColorSpace = field.colorSpace;
        if (field.order.length > gl.getParameter(gl.MAX_ARRAY_TEXTURE_LAYERS)
            || Math.max(field.width, field.height) > gl.getParameter(gl.MAX_TEXTURE_SIZE)) {
            throw new Error("too many or too large views for this graphics driver");
        }
        gl.disable(gl.DITHER);
        gl.bindVertexArray(gl.createVertexArray());
        const { width, height, order: { length: layers } } = field;
        this.colors = this.texture(gl.TEXTURE_2D_ARRAY, gl.RGBA8, gl.LINEAR, width, height, layers);
        this.disparities = this.texture(gl.TEXTURE_2D_ARRAY, gl.R16F, gl.NEAREST, width, height, layers);
        const blocks = [Math.ceil(width / BLOCK_PX), Math.ceil(height / BLOCK_PX)];
        this.blocks = this.texture(gl.TEXTURE_2D_ARRAY, gl.RG16F, gl.NEAREST, ...blocks, layers);
        this.samples = gl.createBuffer();
        gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, this.samples);
        gl.bufferData(gl.UNIFORM_BUFFER, 2 * MAX_SAMPLES * 16, gl.DYNAMIC_DRAW);
        this.table = new Float32Array(2 * MAX_SAMPLES * 4);
        const [far, near] = field.range;
        this.disparityOf = Float32Array.from({ length: 256 }, (_, i) => far + (near - far) * i / 255);
        this.rootOf = Uint8Array.from({ length: 256 }, (_, i) => {  // square root of linear light, see srgb.glsl
            const x = i / 255, light = x <= 0.04045 ? x / 12.92 : ((x + 0.055) / 1.055) ** 2.4;
            return Math.round(Math.sqrt(light) * 255);
        });
    }

    texture(target, format, filter, width, height, layers = 0) {
        const { gl } = this, texture = gl.createTexture();
        gl.bindTexture(target, texture);
        if (layers) gl.texStorage3D(target, 1, format, width, height, layers);
        else gl.texStorage2D(target, 1, format, width, height);
        for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(target, name, filter);
        for (const name of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T]) gl.texParameteri(target, name, gl.CLAMP_TO_EDGE);
        return texture;
    }

    // Targets of one size that a pass draws into together; row 0 comes first. shared: a first texture that is there.
    target(width, height, count, shared = null) {
        const { gl } = this, framebuffer = gl.createFramebuffer(), textures = shared ? [shared] : [];
        while (textures.length < count) {
            textures.push(this.texture(gl.TEXTURE_2D, this.floats, gl.LINEAR, width, height));
        }
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        textures.forEach((texture, i) =>
            gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + i, gl.TEXTURE_2D, texture, 0));
        gl.drawBuffers(textures.map((_, i) => gl.COLOR_ATTACHMENT0 + i));
        this.made.push({ framebuffer, textures });
        return { framebuffer, textures, width, height };
    }

    // Of one picture size; those of the size before are freed.
    targetsOf(width, height) {
        if (this.targets?.width === width && this.targets.height === height) return this.targets;
        for (const { framebuffer, textures } of this.made.splice(0)) {
            this.gl.deleteFramebuffer(framebuffer);
            textures.forEach((texture) => this.gl.deleteTexture(texture));
        }
        const across = Math.ceil(width / TILE_PX), down = Math.ceil(height / TILE_PX);
        this.targets = { width, height, across, down, light: this.target(width, height, 1) };
        for (const name of ["tiles", "wideTiles"]) this.targets[name] = this.target(across, down, 1);
        this.targets.spans = this.target(across, down, 2);
        return this.targets;
    }

    layersOf(targets) {
        const half = [(targets.width + 1) >> 1, (targets.height + 1) >> 1];
        targets.layers ??= {
            sums: this.target(targets.width, targets.height, 3, targets.light.textures[0]),
            across: this.target(...half, 2), smooth: this.target(...half, 2),
        };
        return targets.layers;
    }

    // Stores a view. colors: RGBA bytes, sRGB-encoded; depth: RGBA bytes whose red is the disparity, or null.
    upload(layer, colors, depth) {
        const { gl, field: { width, height }, rootOf, disparityOf } = this, count = width * height;
        for (let i = 0; i < 4 * count; i += 4) {
            colors[i] = rootOf[colors[i]];
            colors[i + 1] = rootOf[colors[i + 1]];
            colors[i + 2] = rootOf[colors[i + 2]];
            colors[i + 3] = depth ? depth[i] : 0;
        }
        const write = (texture, format, type, data, w, h) => {
            gl.bindTexture(gl.TEXTURE_2D_ARRAY, texture);
            gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
            gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, layer, w, h, 1, format, type, data);
        };
        write(this.colors, gl.RGBA, gl.UNSIGNED_BYTE, colors, width, height);
        if (!depth) return;
        const across = Math.ceil(width / BLOCK_PX), down = Math.ceil(height / BLOCK_PX);
        const values = this.values ??= new Float32Array(count), ranges = new Float32Array(2 * across * down);
        for (let i = 0; i < ranges.length; i += 2) [ranges[i], ranges[i + 1]] = [Infinity, -Infinity];
        for (let y = 0, i = 0; y < height; y++) {
            for (let x = 0; x < width; x++, i++) {
                const value = disparityOf[depth[4 * i]], block = 2 * ((y >> 4) * across + (x >> 4));
                values[i] = value;
                if (value < ranges[block]) ranges[block] = value;
                if (value > ranges[block + 1]) ranges[block + 1] = value;
            }
        }
        write(this.disparities, gl.RED, gl.FLOAT, values, width, height);
        write(this.blocks, gl.RG, gl.FLOAT, ranges, across, down);
    }

    // Draws with the program of a shader and its switches. values, textures: see Program.use. keeps: whether what is
    // there is added to, or, with "multiplies", multiplied.
    draw(fragment, switches, target, values, textures = {}, vertices = 3, keeps = false) {
        const { gl, shaders } = this, names = switches.filter(Boolean), key = [fragment, ...names].join(" ");
        if (!this.programs.has(key)) {
            const defines = names.map((name) => `#define ${name} 1\n`).join("");
            const source = (name) => shaders.preamble + defines + shaders[name];
            this.programs.set(key, new Program(gl, source("fullscreen.vert"), source(fragment), key));
        }
        gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
        gl.viewport(0, 0, target.width, target.height);
        (keeps ? gl.enable : gl.disable).call(gl, gl.BLEND);
        if (keeps === "multiplies") gl.blendFunc(gl.ZERO, gl.SRC_COLOR);
        else gl.blendFunc(gl.ONE, gl.ONE);
        const bound = Object.entries(textures).map(([name, texture]) => [name, [gl.TEXTURE_2D, texture]]);
        const arrays = ["colors", "disparities", "blocks"].map((name) => [name, [gl.TEXTURE_2D_ARRAY, this[name]]]);
        this.programs.get(key).use({ part: [0, 0, 1, 1], ...values }, Object.fromEntries([...arrays, ...bound]));
        gl.drawArrays(gl.TRIANGLES, 0, vertices);
    }

    // ---- Pictures: summed up in passes, as accumulation.py and passes.py have it

    begin(optics, part, width, height, level = LEVELS[0]) {
        const lens = lensOf(optics, this.field, Math.round(width / part.width), level);
        const places = level === LEVELS[0] ? passPlaces(lens, this.field) : [{ t: 0, s: 0 }];
        this.picture = { lens, part, width, height, places, pass: 0, samples: null, at: 0, holdsSum: false };
        this.picture.targets = this.targetsOf(width, height);
    }

    get isComplete() {
        return !this.picture || this.picture.pass >= this.picture.places.length;
    }

    // The next samples, as many as one program takes; true where a pass was finished, and the picture with it.
    step() {
        const { picture, field } = this, { lens, targets } = picture, place = picture.places[picture.pass];
        const sum = lens.keepsLayers ? this.layersOf(targets).sums : targets.light;
        if (!picture.samples) {
            picture.samples = lens.share > 0 ? samplesOfPass(lens, field, place, picture.pass) : [];
            if (picture.pass === 0 && lens.keepsLayers) this.findDefocus(picture);
        }
        if (picture.at === 0 && lens.share < 1) this.drawPinhole(picture, sum, place);
        let batch = picture.samples.slice(picture.at, picture.at + MAX_SAMPLES);
        const change = batch.findIndex((sample) => sample.isDirect !== batch[0].isDirect);
        if (change > 0) batch = batch.slice(0, change);
        if (batch.length) this.drawAperture(picture, sum, batch);
        picture.at += batch.length;
        if (picture.at < picture.samples.length) return false;
        Object.assign(picture, { pass: picture.pass + 1, samples: null, at: 0 });
        if (lens.keepsLayers && lens.share === 1 && picture.pass > 1) {
            const tiles = targets.wideTiles.textures[0];
            this.draw("finished_tiles.frag", [], sum, { passes: picture.pass }, { tiles }, 3, "multiplies");
        }
        this.finish(picture);
        return true;
    }

    fieldValues({ lens, part }) {
        const { range: [farthest, nearest], width, height } = this.field;
        return {
            view_size_px: [width, height], nearest, farthest, focus_disparity: lens.focus, focus_tilt: [0, 0],
            focus_range: 0, dolly: [0, 0], blur_px: lens.blurPx, sharp_up_to_px: lens.sharpUpTo,
            part: [part.x, part.y, part.width, part.height],
        };
    }

    switches({ lens }, ...names) {
        return [lens.keepsLayers && "LAYERS", ...names];
    }

    drawPinhole(picture, sum, place) {
        const { lens, part, width, height, targets } = picture, { field } = this;
        const sources = pinholeSources(lens.eye, field).slice(0, lens.mostSources);
        const total = sumOf(sources);
        const rows = new Array(4 * MAX_SOURCES).fill(0), steps = new Array(MAX_SOURCES).fill(0);
        sources.forEach(({ t, s, weight }, i) => {
            const layer = field.layers.get(hash({ t, s }));
            rows.splice(4 * i, 4, s - lens.eye.s, t - lens.eye.t, layer, weight / total);
            const parallaxPx = Math.hypot(t - lens.eye.t, s - lens.eye.s) * (field.range[1] - field.range[0]);
            steps[i] = field.hasDisparity ? clamp(Math.ceil(parallaxPx), 2, MAX_SEARCH_STEPS) : 0;
        });
        const pixel = [part.width / width, part.height / height];
        const values = {
            ...this.fieldValues(picture), source_count: sources.length, sources: rows, search_steps: steps,
            share: 1 - lens.share, pixel_uv: pixel, block_px: BLOCK_PX, tile_uv: [1 / targets.across, 1 / targets.down],
            within_pixel: [(place.s + OFF_BORDER_PX) * pixel[0], (place.t + OFF_BORDER_PX) * pixel[1]],
        };
        if (!steps.some((count) => count)) {
            this.draw("pinhole.frag", this.switches(picture), sum, values, {}, 3, picture.holdsSum);
        } else {
            this.draw("march_intervals.frag", [], targets.spans, values);
            const [first, second] = targets.spans.textures, tiles = targets.across * targets.down;
            const spans = { intervals_of_0_and_1: first, intervals_of_2_and_3: second };
            for (const kind of ["FLAT", "EDGES"]) {
                const switches = this.switches(picture, kind);
                this.draw("pinhole.frag", switches, sum, values, spans, 6 * tiles, picture.holdsSum);
            }
        }
        picture.holdsSum = true;
    }

    setSamples(samples, lens) {
        const { layers, hasDisparity } = this.field;
        samples.forEach(({ t, s, weight, stored, sparse }, i) => {
            this.table.set([s - lens.eye.s, t - lens.eye.t, layers.get(hash(stored)), weight], 4 * i);
            const reprojection = [stored.s - s, stored.t - t, Number(hasDisparity), sparse ?? 0];
            this.table.set(reprojection, 4 * (MAX_SAMPLES + i));
        });
        this.gl.bufferSubData(this.gl.UNIFORM_BUFFER, 0, this.table);
        return { sample_count: samples.length };
    }

    drawAperture(picture, sum, batch) {
        const { lens, targets } = picture, reprojects = batch.some((sample) => !sample.isDirect);
        const tiles = lens.keepsLayers && "TILES";
        const values = {
            ...this.fieldValues(picture), ...this.setSamples(batch, lens), share: lens.share, passes: picture.pass,
            sparse_count: batch.filter((sample) => sample.sparse !== undefined).length,
            sparse_up_to_px: picture.samples.some(({ sparse }) => sparse !== undefined) ? lens.sparseUpToPx : 0,
        };
        const switches = this.switches(picture, tiles, reprojects && "REPROJECT");
        const textures = tiles
            ? { tiles: targets.tiles.textures[0], wide_tiles: targets.wideTiles.textures[0] } : {};
        this.draw("aperture.frag", switches, sum, values, textures, 3, picture.holdsSum);
        picture.holdsSum = true;
    }

    findDefocus(picture) {
        const { lens, part, targets } = picture, { field } = this, { width, height } = field;
        const eye = { ...lens.eye, weight: 1, ...answered(lens.eye, field) };
        let samples = picture.samples.length ? picture.samples : [eye];
        const direct = samples.filter((sample) => sample.isDirect);
        if (2 * direct.length > samples.length) samples = direct;
        const every = Math.ceil(samples.length / MAX_SAMPLES);
        samples = samples.filter((_, i) => i % every === 0);
        const tilePx = Math.max(part.width * width / targets.across, part.height * height / targets.down);
        const values = {
            ...this.fieldValues(picture), ...this.setSamples(samples, lens), block_px: BLOCK_PX,
            tile_uv: [1 / targets.across, 1 / targets.down],
            taps: Math.min(1 + Math.ceil(tilePx / BLOCK_PX), MAX_TILE_TAPS),
        };
        const reprojects = samples.some((sample) => !sample.isDirect) && "REPROJECT";
        this.draw("defocus_tiles.frag", [reprojects], targets.tiles, values);
        const reach = Math.min(Math.ceil((lens.widestBlurPx / 2 + TILE_PX / 2) / TILE_PX), 4);
        // The pinhole's share comes with every pass.
        const [onePassPx, least] = lens.share === 1 ? [ONE_PASS_UP_TO_PX, LEAST_PASSES] : [-1, 1e9];
        const limits = { one_pass_up_to_px: onePassPx, pass_blur_px: PASS_BLUR_PX, least_passes: least };
        const [tiles] = targets.tiles.textures;
        this.draw("widen_tiles.frag", [], targets.wideTiles, { reach, ...limits }, { tiles });
    }

    // Smooths what is summed up, and shows it: always at the canvas' own size.
    finish(picture) {
        const { lens, targets, width, height, pass } = picture, { gl, canvas } = this;
        const smoothing = { passes: Math.max(pass, 1), spread: 1 }, [tiles] = targets.wideTiles.textures;
        const textures = { focus_layer: targets.light.textures[0] };
        if (lens.keepsLayers) {
            const { sums, across, smooth } = this.layersOf(targets), [, foreground, background] = sums.textures;
            const spread = (from, to, step) => this.draw("smooth.frag", [], to,
                { ...smoothing, empty_up_to_px: lens.sharpUpTo[0], texel_step: step },
                { foreground_layer: from[0], background_layer: from[1], tiles });
            spread([foreground, background], across, [1 / across.width, 0]);
            spread(across.textures, smooth, [0, 1 / smooth.height]);
            const [smooth_foreground, smooth_background] = smooth.textures;
            Object.assign(textures, { smooth_foreground, smooth_background, tiles },
                { foreground_layer: foreground, background_layer: background });
        }
        if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
        this.draw("present.frag", [lens.keepsLayers && "LAYERS"], { framebuffer: null, width, height },
            { exposure: 1, ...smoothing }, textures);
        gl.flush();
    }
}

