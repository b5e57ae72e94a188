// Draws a light field through a virtual lens, by the desktop's shaders in WebGL 2. Offsets are { t, s } in view steps
// (down, right), disparities are in px per view step, as in the core. viewer/gpu/refocus and
// iibr_core/beyond/aperture_sampling.py have the same names and numbers and explain them.

// The numbers of iibr_core/beyond/picture_quality.py by name, which the page carries.
export const NUMBERS = {};
export const WHOLE = { x: 0, y: 0, width: 1, height: 1 };

export const clamp = (x, low, high) => Math.min(Math.max(x, low), high);
export const hash = (place) => `${place.t},${place.s}`;
export const rounded = (x) => (x % 1 === 0.5 ? 2 * Math.round(x / 2) : Math.round(x));  // halves to even, as in Python

const sumOf = (weighted) => weighted.reduce((sum, one) => sum + one.weight, 0);
export const fraction = (number, step) => (number * step + 0.5) % 1;

// ---- Places of a picture's cameras in the aperture, which is a disc: see aperture_sampling.py

// Returns the diameter of the circle around an aperture of diameter 1. cut: side of the square of views that crops it.
const reachOf = (cut) => Math.min(Math.SQRT2 * cut, 1);

// Returns how open an aperture of diameter 1 is at a point, 0 to 1.
function openness(t, s, cut) {
    const inside = Math.min(0.5 - Math.hypot(t, s), cut / 2 - Math.max(Math.abs(t), Math.abs(s)));
    return clamp(0.5 + inside / (NUMBERS.EDGE * reachOf(cut)), 0, 1);
}

// Returns the area of an aperture of diameter 1, as a share of the circle's, and its second moment per axis.
function measure(cut) {
    const side = NUMBERS.GRID_SIDE;
    const places = Array.from({ length: side }, (_, i) => reachOf(cut) * ((i + 0.5) / side - 0.5));
    const points = places.flatMap((t) => places.map((s) => ({ weight: openness(t, s, cut), square: t * t + s * s })));
    const total = sumOf(points), moment = points.reduce((sum, { weight, square }) => sum + weight * square, 0);
    return { area: Math.min(total / side ** 2 * 4 / Math.PI, 1), moment: moment / total / 2 };
}

// Returns those of `count` points of a spiral that lie in an aperture of diameter 1.
function openSpiral(cut, count, passIndex) {
    const all = Array.from({ length: count }, (_, i) => {
        const radius = reachOf(cut) / 2 * Math.sqrt((i + fraction(passIndex, NUMBERS.SHIFT_STEP)) / count);
        const angle = NUMBERS.GOLDEN_ANGLE * i + 2 * Math.PI * NUMBERS.TURN_STEP * passIndex;
        return { t: radius * Math.sin(angle), s: radius * Math.cos(angle) };
    });
    return all.filter(({ t, s }, i) => openness(t, s, cut) > fraction(passIndex * count + i, NUMBERS.SQRT_STEPS[2]));
}

// Returns about `count` points of the aperture for one pass, from its middle. The first pass is moved and scaled: its
// mean and its variance are the aperture's.
export function aperturePoints(diameter, widest, count, passIndex, cell = 0) {
    const cut = Math.min(widest / diameter, 1), { area, moment } = measure(cut);
    const points = openSpiral(cut, Math.max(rounded(count / area), count), passIndex);
    if (!points.length) return [{ t: 0, s: 0 }];
    const mean = (of) => points.reduce((sum, point) => sum + of(point), 0) / points.length;
    const middle = passIndex ? { t: 0, s: 0 } : { t: mean(({ t }) => t), s: mean(({ s }) => s) };
    const own = passIndex ? moment : mean(({ t, s }) => ((t - middle.t) ** 2 + (s - middle.s) ** 2) / 2);
    const wanted = Math.max(moment - NUMBERS.COARSENESS_VARIANCE * (cell / diameter) ** 2, 0);
    const scale = own > 0 ? Math.sqrt(wanted / own) : 1;
    return points.map((point) => {
        const t = scale * (point.t - middle.t), s = scale * (point.s - middle.s);
        const beyond = Math.max(Math.hypot(t, s) / (reachOf(cut) / 2), 1);  // it stays in the circle
        return { t: diameter * t / beyond, s: diameter * s / beyond };
    });
}

// ---- Which stored views answer the cameras: plain numbers, see view_sampling.py. field: { rows, columns, width,
// height, range, hasDisparity, step, rowStep, layers }; step: between views that are there, in view steps, the middle
// one among them; rowStep: distance between rows, in distances between columns; layers: theirs, by "t,s". Samples are
// { t, s, view, weight }: a camera's place from the eye, the view that answers it, and how much it counts.

// Returns the first and the last offset of the stored views along an axis of `count` views.
export const ends = (count, step) => (
    [-(count >> 1), count - 1 - (count >> 1)].map((end) => Math.trunc(end / step) * step));

// Returns the views before and after a place along an axis with their shares, without shares of 0.
function bracket(x, count, step) {
    const [first, last] = ends(count, step), inside = clamp(x, first, last);
    const low = clamp(Math.floor(inside / step) * step, first, Math.max(last - step, first));
    const share = (inside - low) / step;
    return [[low, 1 - share], [low + step, share]].filter(([, weight]) => weight > 0);
}

// Returns the corners of a place's cell of the grid, with bilinear weights.
function cornersOf({ t, s }, { rows, columns, step }) {
    const across = bracket(s, columns, step);
    return bracket(t, rows, step).flatMap(([row, wt]) => across.map(([column, ws]) => (
        { t: row, s: column, weight: wt * ws })));
}

// Returns cameras at points of the lens. A sequence chooses the corner of its cell that answers each camera.
export function answeredSamples(points, first, eye, { rows, columns, step }) {
    const chosen = (two, number) => (number < two.at(-1)[1] ? two.at(-1) : two[0])[0];
    return points.map(({ t, s }, i) => {
        const row = chosen(bracket(eye.t + t, rows, step), fraction(first + i, NUMBERS.SQRT_STEPS[0]));
        const column = chosen(bracket(eye.s + s, columns, step), fraction(first + i, NUMBERS.SQRT_STEPS[1]));
        return { t, s, view: { t: row, s: column }, weight: 1 };
    });
}

// Returns the stored views in place of cameras, weighted by the points around them: views without disparity cannot be
// warped.
export function blendedSamples(points, eye, field) {
    const asked = new Map();
    for (const point of points) {
        for (const corner of cornersOf({ t: eye.t + point.t, s: eye.s + point.s }, field)) {
            const weight = corner.weight + (asked.get(hash(corner))?.weight ?? 0);
            asked.set(hash(corner), { ...corner, weight });
        }
    }
    const least = NUMBERS.MIN_WEIGHT * points.length;
    const kept = [...asked.values()].filter(({ weight }) => weight > least), total = sumOf(kept);
    return kept.map((view) => ({ t: view.t - eye.t, s: view.s - eye.s, view, weight: view.weight / total }));
}

// ---- The lens of one picture: its cameras are added up in passes, where the desktop blurs slices (see discs.py)

export function lensOf(optics, field, widthPx, level = NUMBERS.LEVELS[0]) {
    const diameter = Math.max(optics.aperture, 0), widest = Math.max(field.rows, field.columns);
    const beside = Math.max(...field.range.map((edge) => Math.abs(edge - optics.focus)));
    const blurPx = Math.min(diameter, widest) * beside * widthPx / field.width;
    const best = clamp(Math.ceil(blurPx / NUMBERS.FIRST_SPACING_PX), NUMBERS.MIN_PASS, NUMBERS.MAX_PASS);
    return { ...optics, diameter, widest, blurPx, level, camerasPerPass: Math.max(rounded(best * level.cameras), 1) };
}

// Returns the number of passes until the most blurred surface is smooth.
function passesThroughAperture({ level, blurPx, camerasPerPass }) {
    if (level !== NUMBERS.LEVELS[0]) return 1;
    return Math.ceil(clamp(NUMBERS.CAMERAS_PER_PX * blurPx, NUMBERS.MIN_CAMERAS, NUMBERS.MAX_CAMERAS) / camerasPerPass);
}

// Returns the number of passes until surfaces and their edges are smooth.
export function passCount(lens, field) {
    if (!field.hasDisparity) return 1;
    if (lens.diameter > 0) return passesThroughAperture(lens);
    return lens.level === NUMBERS.LEVELS[0] && !field.layers.has(hash(lens.eye)) ? NUMBERS.EDGE_PASSES : 1;
}

// Returns the side, in view steps, of the square of the aperture that a camera stands for. The first pass is shown
// alone: its cameras share the aperture among themselves.
export function cellOf(lens, passIndex) {
    const { diameter, widest, camerasPerPass } = lens;
    if (diameter === 0) return 0;
    const cut = Math.min(widest / diameter, 1), passes = passIndex > 0 ? passesThroughAperture(lens) : 1;
    const area = measure(cut).area * Math.PI / 4 * (diameter * reachOf(cut)) ** 2;
    return Math.sqrt(area / (camerasPerPass * passes));
}

// Returns the cameras of a pass and the views that answer them.
export function samplesOf(lens, field, passIndex) {
    const { eye, diameter, widest, camerasPerPass: count } = lens;
    if (diameter === 0) {
        const heaviest = cornersOf(eye, field).sort((a, b) => b.weight - a.weight);
        const sources = heaviest.slice(0, lens.level.sources), total = sumOf(sources);
        return sources.map((view) => ({ t: 0, s: 0, view, weight: view.weight / total }));
    }
    if (!field.hasDisparity) {
        return blendedSamples(aperturePoints(diameter, widest, NUMBERS.BLEND_POINTS, passIndex), eye, field);
    }
    const points = aperturePoints(diameter, widest, count, passIndex, cellOf(lens, passIndex))
        .map(({ t, s }) => ({ t: t / field.rowStep, s }));  // the lens is round, however far rows stand apart
    return answeredSamples(points, passIndex * count, eye, field);
}

// Returns the disparity at a place of the picture (0..1) as the eye sees it: of the first surface in the middle view.
export function pick(field, middle, eye, u, v) {
    const [far, near] = field.range, { width, height } = field;
    const across = eye.s, down = field.rowStep * eye.t;
    const steps = 2 * Math.ceil(Math.max(Math.abs(across), Math.abs(down)) * (near - far)) + 1;
    for (let k = 0; ; k++) {
        const disparity = near - (near - far) * k / steps;
        const x = clamp(Math.floor(u * width + disparity * across), 0, width - 1);
        const y = clamp(Math.floor(v * height + disparity * down), 0, height - 1);
        const seen = far + (near - far) * middle[y * width + x] / 255;
        if (seen >= disparity || k >= steps) return seen;
    }
}

// ---- WebGL 2: programs of the desktop's shaders, textures, targets

// Returns a program, and functions that set its uniforms, by name.
function linked(gl, vertex, fragment) {
    const program = gl.createProgram(), uniforms = new Map();
    for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
        const shader = gl.createShader(kind);
        gl.shaderSource(shader, source);
        gl.compileShader(shader);
        gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) {
        const logs = gl.getAttachedShaders(program).map((shader) => gl.getShaderInfoLog(shader));
        throw new Error(`${gl.getProgramInfoLog(program)} ${logs.join(" ")}`);
    }
    const puts = { [gl.FLOAT]: "uniform1fv", [gl.FLOAT_VEC2]: "uniform2fv", [gl.FLOAT_VEC4]: "uniform4fv" };
    for (let i = gl.getProgramParameter(program, gl.ACTIVE_UNIFORMS) - 1; i >= 0; i--) {
        const { name, type } = gl.getActiveUniform(program, i), put = puts[type] ?? "uniform1iv";  // integers, samplers
        const place = gl.getUniformLocation(program, name);
        if (place) uniforms.set(name, (value) => gl[put](place, [value].flat()));
    }
    return { program, uniforms };
}

export class Renderer {
    constructor(canvas, shaders, field) {
        const gl = canvas.getContext("webgl2", { alpha: false, antialias: false, preserveDrawingBuffer: true });
        const extensions = ["EXT_color_buffer_half_float", "EXT_color_buffer_float"];
        if (!extensions.some((name) => gl?.getExtension(name))) throw new Error("no WebGL 2 that draws half floats");
        Object.assign(this, { gl, canvas, shaders, field, programs: new Map() });
        if ("drawingBufferColorSpace" in gl) gl.drawingBufferColorSpace = field.colorSpace;
        const side = Math.max(field.width, field.height);
        if (side > gl.getParameter(gl.MAX_TEXTURE_SIZE)) throw new Error(`no textures of ${side} pixels`);
        gl.disable(gl.DITHER);
        gl.blendFunc(gl.ONE, gl.ONE);
        const { width, height, order: { length: layers } } = field;
        this.colors = this.texture(gl.TEXTURE_2D_ARRAY, gl.RGBA8, gl.LINEAR, width, height, layers);
        this.target = { framebuffer: gl.createFramebuffer(), texture: null };  // light weighted by alpha, row 0 first
        this.table = new Float32Array(3 * NUMBERS.MAX_SAMPLES * 4);
        gl.bindBufferBase(gl.UNIFORM_BUFFER, 0, gl.createBuffer());
        gl.bufferData(gl.UNIFORM_BUFFER, this.table, gl.DYNAMIC_DRAW);
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

    // Stores a view. rgba: bytes, sRGB-encoded; alpha is the disparity in the range of the field.
    upload(layer, rgba) {
        const { gl, field: { width, height }, rootOf } = this;
        for (let i = 0; i < rgba.length; i += 4) {
            rgba[i] = rootOf[rgba[i]];
            rgba[i + 1] = rootOf[rgba[i + 1]];
            rgba[i + 2] = rootOf[rgba[i + 2]];
        }
        gl.bindTexture(gl.TEXTURE_2D_ARRAY, this.colors);
        gl.texSubImage3D(gl.TEXTURE_2D_ARRAY, 0, 0, 0, layer, width, height, 1, gl.RGBA, gl.UNSIGNED_BYTE, rgba);
    }

    // Draws with the program of a shader and its switches. values, textures: of uniforms and samplers by name; those
    // that the compiler left out are skipped.
    draw(fragment, switches, { framebuffer, x = 0, y = 0, width, height }, values, textures) {
        const { gl, shaders } = this, names = switches.filter(Boolean), key = [fragment, ...names].join(" ");
        if (!this.programs.has(key)) {
            const defines = names.map((name) => `#define ${name} 1\n`).join("");
            const source = (name) => shaders["preamble.glsl"] + defines + shaders[name];
            const vertex = fragment === "window.frag" ? "window.vert" : "fullscreen.vert";
            this.programs.set(key, linked(gl, source(vertex), source(fragment)));
        }
        gl.bindFramebuffer(gl.FRAMEBUFFER, framebuffer);
        gl.viewport(x, y, width, height);
        const { program, uniforms } = this.programs.get(key);
        gl.useProgram(program);
        Object.entries(textures).forEach(([name, [target, texture]], unit) => {
            gl.activeTexture(gl.TEXTURE0 + unit);
            gl.bindTexture(target, texture);
            uniforms.get(name)?.(unit);
        });
        for (const [name, value] of Object.entries(values)) uniforms.get(name)?.(value);
        gl.drawArrays(gl.TRIANGLE_STRIP, 0, 4);  // the fourth corner of fullscreen.vert lies outside
    }

    // ---- Pictures, which are sums of passes: see accumulation.py and passes.py

    // Clears the target, whose texture is another one for another size.
    begin(optics, part, width, height, level = NUMBERS.LEVELS[0]) {
        const { gl, field, target } = this, lens = lensOf(optics, field, Math.round(width / part.width), level);
        const passes = passCount(lens, field);
        // Half floats end at 65504 and are coarse near 0, where surfaces lie that no view sees: weights add up to about
        // half of their range. Powers of two keep the sum exact.
        const cameras = lens.diameter > 0 ? passes * lens.camerasPerPass : passes;
        const gain = 2 ** (15 - Math.ceil(Math.log2(cameras)));
        this.picture = { lens, part, width, height, passes, gain, pass: 0, done: 0 };
        gl.bindFramebuffer(gl.FRAMEBUFFER, target.framebuffer);
        if (target.width !== width || target.height !== height) {
            gl.deleteTexture(target.texture);
            const texture = this.texture(gl.TEXTURE_2D, gl.RGBA16F, gl.NEAREST, width, height);
            gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0, gl.TEXTURE_2D, texture, 0);
            Object.assign(target, { texture, width, height });
        }
        gl.clear(gl.COLOR_BUFFER_BIT);
    }

    // Draws the next pass, and shows what there is on the canvas, which gets the picture's size.
    step() {
        const { gl, canvas, field, picture: { lens, pass }, target: { width, height, texture } } = this;
        this.pass(samplesOf(lens, field, pass));
        if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
        const values = { exposure: 1, part: [0, 0, 1, 1] }, textures = { light_sum: [gl.TEXTURE_2D, texture] };
        this.draw("present.frag", [], { framebuffer: null, width, height }, values, textures);
        gl.flush();
    }

    setSamples(samples) {
        const { MAX_SAMPLES, OFF_BORDER_PX, SQRT_STEPS } = NUMBERS;
        const { gl, table, field: { layers, hasDisparity }, picture: { lens, gain, pass, done } } = this;
        samples.forEach(({ t, s, view, weight, answer }, i) => {
            // All views that answer a pinhole are looked up at the same place of the pixel.
            const number = lens.diameter === 0 ? pass : done + i;
            const within = SQRT_STEPS.slice(3).map((step) => fraction(number, step) - 0.5 + OFF_BORDER_PX);
            table.set([s, t, ...within], 4 * i);
            table.set(answer ?? [view.s - lens.eye.s - s, view.t - lens.eye.t - t, 0], 4 * (MAX_SAMPLES + i));
            table.set([layers.get(hash(view)), Number(hasDisparity), gain * weight, 0], 4 * (2 * MAX_SAMPLES + i));
        });
        gl.bufferSubData(gl.UNIFORM_BUFFER, 0, table);
    }

    // Adds the light of these cameras. switches, values, textures: further ones, see `draw`. If a camera has an answer,
    // the shader finds its view, see lens.frag.
    pass(samples, switches = [], values = {}, textures = {}) {
        const { gl, field, picture } = this, { lens, part, width, height, pass } = picture;
        const { hasDisparity, range: [farthest, nearest] } = field;
        const mostPx = field.layers.size > 1 ? NUMBERS.NEAR_PX : NUMBERS.ALONE_NEAR_PX;
        const isNear = samples.every(({ t, s, view, answer }) => {
            const [dt, ds] = answer ? [field.step, field.step] : [view.t - lens.eye.t - t, view.s - lens.eye.s - s];
            const px = Math.hypot(field.rowStep * dt, ds) * (nearest - farthest);
            return px <= mostPx && Math.max(Math.abs(dt), Math.abs(ds)) <= field.step;
        });
        this.setSamples(samples);
        gl.enable(gl.BLEND);
        this.draw("lens.frag", [hasDisparity && "WARP", hasDisparity && isNear && "NEAR", lens.diameter > 0 && "SUMMED", ...switches], this.target, {
            sample_count: samples.length, cell_views: cellOf(lens, pass), view_size_px: [field.width, field.height],
            pixel_uv: [part.width / width, part.height / height], farthest, nearest, focus_disparity: lens.focus,
            part: [part.x, part.y, part.width, part.height], field_part: [0, 0, 1, 1], view_step: [1, field.rowStep],
            ...values,  // others stay 0
        }, { colors: [gl.TEXTURE_2D_ARRAY, this.colors], ...textures });
        gl.disable(gl.BLEND);
        Object.assign(picture, { pass: pass + 1, done: picture.done + samples.length });
    }
}
